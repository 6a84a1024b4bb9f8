# SPDX-License-Identifier: GPL-3.0-or-later
"""What waiting is made of before and beside the samples: start-up, scene build, shader compilation, a frame's fixed part."""

from collections.abc import Sequence

from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.work_precision.journal import Notes
from true_diffuse.scripts.studies.work_precision.run import BUILD, FIRST, STARTUP


def records(curves: Sequence[Record], journal: Notes) -> list[Record]:
    """Return the parts of the time [s]: what, where, and seconds; None where it was not measured.

    `shader_seconds` is what the first render took beyond a later one, in the order of the study: a shader that an earlier scene has
    compiled is not compiled again.
    """
    found: list[Record] = [
        {"what": "start-up", "scene": None, "engine": one["engine"], "label": None, "seconds": one["seconds"]}
        for one in journal.of(STARTUP)
    ]
    found += [
        {"what": "scene build", "scene": one["scene"], "engine": None, "label": None, "seconds": one["seconds"]}
        for one in journal.of(BUILD)
    ]
    builds = {(one["scene"], one["engine"], one["label"]): one["build_seconds"] for one in journal.of(FIRST)}
    for curve in curves:
        if curve["engine"] == "glsl":
            continue
        parts = {
            "material build": builds.get((curve["scene"], curve["engine"], curve["label"])),
            "shaders": curve["first_seconds"],
            "frame": curve["seconds_fixed"],
            "sample": curve["seconds_per_sample"],
        }
        place = {"scene": curve["scene"], "engine": curve["engine"], "label": curve["label"]}
        found += [{"what": what, **place, "seconds": seconds} for what, seconds in parts.items()]
    return found
