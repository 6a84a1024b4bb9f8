# SPDX-License-Identifier: GPL-3.0-or-later
"""The files of the study, report.json, report.csv and index.html, made of what a journal holds."""

import csv
import io
import json
from collections.abc import Sequence

from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.work_precision import claims, curves, page, run, stability
from true_diffuse.scripts.studies.work_precision.journal import Notes
from true_diffuse.scripts.studies.work_precision.variants import SIGMA

VERSION = 2  # of report.json
COLUMNS = (
    "scene",
    "engine",
    "osl",
    "label",
    "kind",
    "group",
    "model",
    "quality",
    "sigma",
    "target",
    "reference",
    "reference_error",
)


def options(quick: bool, engines: Sequence[str], scenes: Sequence[str], character: str) -> Record:
    """Return what was asked for as report.json keeps it."""
    asked: Record = {"quick": quick, "engines": list(engines), "scenes": list(scenes)}
    return asked | ({"character": character} if "five" in scenes else {})


def files(about: Record, journal: Notes) -> tuple[dict[str, str], list[str]]:
    """Return the text of each file by its name, and what the study recommends, in lines; `about`: environment and options."""
    noise = {one["scene"]: one["error"] for one in journal.of(run.NOISE)}
    found = curves.curves(journal.of(run.UNIT), journal.of(run.FIRST), noise)
    found += [curves.glsl(one, "Oren-Nayar", SIGMA) for one in journal.of(run.GLSL)]
    document: Record = {
        "version": VERSION,
        **about,
        "scenes": list(journal.of(run.BUILD)),
        "curves": found,
        "startup": list(journal.of(run.STARTUP)),
        "stability": list(stability.records()),
        "hard_inputs": [record for one in journal.of(run.HARD_INPUTS) for record in one["records"]],
        "claims": claims.records(found, list(journal.of(run.FORM)), list(journal.of(run.LUMINANCE))),
        "recommendations": curves.recommendations(found),
    }
    texts = {
        "report.json": json.dumps(document, indent=2, allow_nan=False) + "\n",
        "report.csv": table(found),
        "index.html": page.html(document),
    }
    return texts, [f"{one['scene']}, {one['engine']}: {one['text']}" for one in document["recommendations"]]


def table(found: Sequence[Record]) -> str:
    """Return the points of all curves as CSV."""
    rows = [{**{name: curve[name] for name in COLUMNS}, **point} for curve in found for point in curve["points"]]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
