# SPDX-License-Identifier: GPL-3.0-or-later
"""Studies as jobs: writes the bundle that compare.py and report.py order with --job, and does its tasks for task.py."""

import sys
from argparse import ArgumentTypeError
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from true_diffuse.scripts.cli.console import BadInput, Terminal
from true_diffuse.scripts.cli.outputs import Staging
from true_diffuse.scripts.farm import bundle, inputs
from true_diffuse.scripts.farm.results import BatchError, Results

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.scripts.farm.face import Order as FaceOrder
    from true_diffuse.scripts.farm.five import Order
    from true_diffuse.scripts.farm.report import Order as ReportOrder
    from true_diffuse.scripts.farm.worker import Show

COLLECT = "Merge the records, build the pictures and the report; name what is missing or damaged"


def frame_list(text: str) -> tuple[int, ...]:
    """The type of the option --frames."""
    try:
        return inputs.frame_numbers(text)
    except ValueError as error:
        raise ArgumentTypeError(str(error)) from None


def chunk_size(text: str) -> int:
    """The type of the option --chunk."""
    if not text.isdecimal() or not 1 <= int(text) <= inputs.MOST_FRAMES:
        raise ArgumentTypeError(f"{text!r} is not a whole number from 1 to {inputs.MOST_FRAMES}")
    return int(text)


def characters(given: Sequence[str]) -> dict[str, str]:
    """Return the characters that are `given`, patterns of files among them, by name. Raises BadInput, having looked for all."""
    from true_diffuse.scripts.characters import character

    try:
        named = inputs.characters(given, tuple(character.INCLUDED))
        for who in named.values():
            if who not in character.INCLUDED:
                character.check_file(who)
    except (ValueError, character.CharacterError) as error:
        raise BadInput(str(error)) from error
    return named


def write_job(
    name: str,
    description: str,
    document: Mapping[str, Any],
    steps: Sequence[bundle.Step],
    target: tuple[Path, Path | None],
    staging: Staging,
    terminal: Terminal,
) -> None:
    """Write the bundle of a job, and say how to run it. `target` is its folder and, where one is asked for, that of the results."""
    folder, output = target
    if [path for path in folder.iterdir() if path != staging.folder and path.resolve() != staging.folder]:
        raise BadInput(f"job folder {folder} exists and is not empty")
    files = [who for who in document["order"].get("characters", {}).values() if Path(who).is_absolute()]
    collect = bundle.Step("collect", "collect", COLLECT, after=[step.name for step in steps if not _is_waited_for(step, steps)])
    job = bundle.Job(name, description, document, [*steps, collect], files, sys.executable, _blender())
    try:
        bundle.write(job, staging.folder, output.absolute() if output else None)
    except OSError as error:
        raise BadInput(f"cannot write to job folder {folder}: {error.strerror}") from error
    staging.publish()
    given = f" -p OutputDir={output.absolute()}" if output else ""
    terminal.say(f"Wrote the job to {folder}. To run it here: openjd run {folder / 'template.yaml'}{given}")


def _is_waited_for(step: bundle.Step, steps: Sequence[bundle.Step]) -> bool:
    return any(step.name in other.after for other in steps)


def _blender() -> str:
    """Return the Blender that this is, "" where it is Python's module bpy."""
    import bpy

    return bpy.app.binary_path


def five_steps(order: "Order") -> list[bundle.Step]:
    """Return the steps before collect of the five-character comparison.

    The error maps are a step of their own: drawn by collect, one after the other, they would take longer than a farm's renders.
    """
    from true_diffuse.scripts.farm.five import ERROR_MAP

    parameters: list[dict[str, Any]] = [{"name": "Character", "type": "INT", "range": f"0-{len(order.characters) - 1}"}]
    frames = [frame for frame in order.frames if frame is not None]
    if frames:
        chunks = {"defaultTaskCount": order.chunk, "rangeConstraint": "NONCONTIGUOUS"}
        parameters.append({"name": "Frame", "type": "CHUNK[INT]", "range": inputs.frame_range(frames), "chunks": chunks})
    parameters.append({"name": "Engine", "type": "STRING", "range": list(order.engines)})
    looks = {"name": "Look", "type": "STRING", "range": list(order.looks)}
    text, drawn = "Render the picture of a character's five looks, or measure one of them", "Draw the error of the five looks"
    return [
        bundle.Step("render", "render", text, [*parameters, looks]),
        bundle.Step("map", "render", drawn, parameters, fixed=("--look", ERROR_MAP), after=["render"]),
    ]


def face_steps(order: "FaceOrder") -> list[bundle.Step]:
    """Return the steps before collect of the face's comparison."""
    parameters: list[dict[str, Any]] = [
        {"name": "Character", "type": "INT", "range": f"0-{len(order.characters) - 1}"},
        {"name": "Engine", "type": "STRING", "range": list(order.engines)},
        {"name": "Look", "type": "STRING", "range": list(order.looks)},
    ]
    return [bundle.Step("render", "render", "Render the picture of a character's three heads, or measure one of them", parameters)]


class CompareJob:
    """Who does the tasks of a comparison of compare.py."""

    def __init__(self, document: Mapping[str, Any], usable: Sequence["Engine"]) -> None:
        from true_diffuse.scripts.farm import face, five

        self.study: Any = {"five": five, "face": face}[document["study"]]
        self.options = document["options"]
        self.order = self.study.Order.unpacked(document["order"])
        doer: Any = {"five": five.Five, "face": face.Face}[document["study"]]
        self.doer = doer(self.order, usable)

    def do(self, step: str, given: Mapping[str, str], results: Results, show: "Show") -> None:
        """Do the parts that `given` chooses; raises BatchError."""
        from true_diffuse.scripts.farm.worker import Told

        names = list(self.order.characters)
        try:
            character = names[int(given["character"])] if "character" in given else None
            frames = inputs.frame_numbers(given["frame"]) if "frame" in given else self.order.frames
        except (ValueError, IndexError) as error:
            raise BatchError(f"no such task: {error}") from error
        chosen = [
            [
                part
                for part in chunk
                if character in (None, part.character)
                and part.frame in frames
                and given.get("engine", part.engine) == part.engine
                and given.get("look", part.look) == part.look
            ]
            for chunk in self.order.chunks()
        ]
        if not any(chosen):
            raise BatchError(f"no such task: {', '.join(f'{name} {value}' for name, value in given.items())}")
        told = Told(sum(part.work for parts in chosen for part in parts), show)
        for parts in filter(None, chosen):
            self.doer.do(parts, results, told)

    def collect(self, results: Results, staging: Staging) -> list[str]:
        """Write what the parts came to; returns what to say of it. Raises BatchError, BadInput."""
        found = self.study.collect(self.order, results, staging.folder)
        staging.write_json("compare.json", {**found.document, "options": self.options})
        written = staging.publish()
        wrote = f"Wrote {len(found.records)} records and {len(written) - 1} pictures to {staging.target}"
        return [*self.study.summary(found), wrote]


def report_steps(order: "ReportOrder") -> list[bundle.Step]:
    """Return the steps before collect of the study of error against run time: a task for all sample counts of a contestant."""
    from true_diffuse.scripts.farm.report import HOMES, REFERENCE_SEEDS, REFERENCED, SHADERS

    steps = []
    for scene in order.scenes:
        several: list[dict[str, Any]] = []
        if len(order.of_scene(scene)) > 1:
            several = [{"name": "Character", "type": "INT", "range": f"0-{len(order.characters) - 1}"}]
        fixed, first = ("--scene", scene), []
        if scene in REFERENCED:
            seeds = [*several, {"name": "Seed", "type": "INT", "range": list(REFERENCE_SEEDS)}]
            text = "Render what the others are held against, with random numbers of its own each"
            steps.append(bundle.Step(f"reference {scene}", "reference", text, seeds, fixed=fixed))
            first = [steps[-1].name]
        engines, labels = zip(*order.cast(scene), strict=True)
        pairs = [
            {"name": "Engine", "type": "STRING", "range": list(engines)},
            {"name": "Contestant", "type": "STRING", "range": list(labels)},
        ]
        combination = " * ".join([*(one["name"] for one in several), "(Engine, Contestant)"])
        text = "Render a contestant with all of its sample counts"
        steps.append(bundle.Step(f"render {scene}", "render", text, [*several, *pairs], combination, fixed, first))
    if order.hard:
        parameters = [{"name": "Engine", "type": "STRING", "range": [key for key in HOMES if key in order.engines]}]
        text = "Hold GLSL and OSL against the formulas in all digits"
        steps.append(bundle.Step(f"render {SHADERS}", "render", text, parameters, fixed=("--scene", SHADERS)))
    return steps


def _share(show: "Show", done: int, parts: int, percent: float, text: str) -> None:
    """Show how far a part is as a share of all, `done` of which are before it."""
    show((100.0 * done + percent) / parts, text)


class ReportJob:
    """Who does the tasks of the study of error against run time."""

    def __init__(self, document: Mapping[str, Any], usable: Sequence["Engine"]) -> None:
        from true_diffuse.scripts.farm.report import Order, Study

        self.order = Order.unpacked(document["order"])
        self.study = Study(self.order, usable)

    def do(self, step: str, given: Mapping[str, str], results: Results, show: "Show") -> None:
        """Do the parts that `given` chooses; raises BatchError."""
        from true_diffuse.scripts.farm.worker import Told

        names = list(self.order.characters)
        try:
            character = names[int(given["character"])] if "character" in given else None
        except (ValueError, IndexError) as error:
            raise BatchError(f"no such task: {error}") from error
        chosen = [
            part
            for part in self.order.parts()
            if (step == "render" or part.seed)
            and given.get("scene", part.scene) == part.scene
            and character in (None, part.character)
            and given.get("engine", part.engine) == part.engine
            and given.get("contestant", part.label) == part.label
            and given.get("seed", str(part.seed)) == str(part.seed)
        ]
        if not chosen:
            raise BatchError(f"no such task: {', '.join(f'{name} {value}' for name, value in given.items())}")
        for done, part in enumerate(chosen):
            whole = partial(_share, show, done, len(chosen))
            self.study.do(part, results, lambda work, whole=whole: Told(work, whole))

    def collect(self, results: Results, staging: Staging) -> list[str]:
        """Write what the parts came to; returns what to say of it. Raises BatchError, BadInput."""
        from true_diffuse.scripts.farm.report import collect
        from true_diffuse.scripts.studies.work_precision import document

        said = []
        for name, one in collect(self.order, results).items():
            asked = document.options(self.order.quick, self.order.engines, self.order.scenes, name)
            about = {"environment": one.environment, "options": asked}
            if one.environments:
                about["environments"] = one.environments
            prefix = f"{name}_" if len(self.order.characters) > 1 else ""
            texts, advice = document.files(about, one.notes)
            for file, text in texts.items():
                staging.write_text(f"{prefix}{file}", text)
            said += [f"{prefix}{line}" for line in advice]
        written = staging.publish()
        return [*said, f"Wrote {', '.join(written)} to {staging.target}"]
