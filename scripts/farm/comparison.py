# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparisons of compare.py as jobs."""

from collections.abc import Mapping, Sequence
from typing import Any

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.scripts.cli import inputs
from true_diffuse.scripts.cli.console import Progress, Show
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.farm.bundle import Step, character_range, one_of
from true_diffuse.scripts.farm.results import Results
from true_diffuse.scripts.farm.tasks import chosen
from true_diffuse.scripts.studies.comparison import face, five
from true_diffuse.scripts.studies.comparison.base import Collected, JobSpec, Renderer


def steps(spec: JobSpec) -> list[Step]:
    """Return the steps before collect of a comparison.

    The error maps are a step of their own: drawn by collect, one after the other, they would take longer than a farm's renders.
    """
    parameters = [character_range(len(spec.characters))]
    frames = [frame for frame in spec.frames if frame is not None]
    if frames:
        chunks = {"defaultTaskCount": spec.chunk, "rangeConstraint": "NONCONTIGUOUS"}
        parameters.append({"name": "Frame", "type": "CHUNK[INT]", "range": inputs.frame_range(frames), "chunks": chunks})
    parameters.append(one_of("Engine", spec.engines))
    text, drawn = "Render the picture of a character's looks, or measure one of them", "Draw the error of the looks"
    maps = [Step("map", "render", drawn, parameters, fixed=("--look", name), after=["render"]) for name in spec.maps]
    return [Step("render", "render", text, [*parameters, one_of("Look", spec.rendered)]), *maps]


class CompareJob:
    """Does the tasks of a comparison of compare.py."""

    def __init__(self, document: Mapping[str, Any], usable: Sequence[Engine]) -> None:
        study: Any = {"five": five, "face": face}[document["study"]]
        self.options = document["options"]
        self.spec: JobSpec = study.JobSpec.from_json(document["spec"])
        self.renderer: Renderer[Any] = study.Renderer(self.spec, usable)

    def do(self, step: str, given: Mapping[str, str], results: Results, show: Show) -> None:
        """Render the items that `given` chooses; raises WorkError."""
        chunks = list(self.spec.chunks())
        items = set(chosen((item for chunk in chunks for item in chunk), self.spec.characters, given))
        progress = Progress(sum(map(self.spec.work, items)), show)
        for chunk in chunks:
            self.renderer.do([item for item in chunk if item in items], results, progress)

    def collect(self, results: Results, output: OutputFolder) -> list[str]:
        """Write the merged results into `output`; returns lines to print. Raises Incomplete, BadInput."""
        results.check(item.name for chunk in self.spec.chunks() for item in chunk)
        collected = Collected()
        for chunk in self.spec.chunks():
            self.renderer.collect(chunk, results, output.folder, collected)
        output.write_json("compare.json", {**collected.document(), "options": self.options})
        written = output.publish()
        wrote = f"Wrote {len(collected.records)} records and {len(written) - 1} pictures to {output.target}"
        notes = [f"{note['character']}: {note['text']}" for note in collected.notes]
        return [*notes, *self.renderer.summary(collected), wrote]
