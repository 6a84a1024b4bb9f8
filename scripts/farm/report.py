# SPDX-License-Identifier: GPL-3.0-or-later
"""The study of error against run time as a job: a variant's renders in a test scene, the references that some are held against, and
what is measured beside them.

Whoever renders keeps the last scene, so that it is built once and not for every work item. The scene "five" is rendered of every
character; the others are of no character or of our own head.
"""

import re
import time
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, ENGINES, Engine
from true_diffuse.addon.probe.environment import environment
from true_diffuse.scripts.cli.console import Progress, Show
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.farm.bundle import Step, character_range, one_of
from true_diffuse.scripts.farm.results import Results
from true_diffuse.scripts.farm.tasks import chosen
from true_diffuse.scripts.studies.comparison.base import one_line
from true_diffuse.scripts.studies.comparison.outcomes import Rendered, Spec, merged
from true_diffuse.scripts.studies.work_precision import document, run
from true_diffuse.scripts.studies.work_precision.journal import Notes
from true_diffuse.scripts.studies.work_precision.run import HARD_INPUTS, TARGETS
from true_diffuse.scripts.studies.work_precision.test_scenes import REFERENCE_SEEDS, TEST_SCENES, Face, Five, TestScene, build

BESIDE = "beside"  # what is measured beside the variants
REFERENCED = (Five.name, Face.name)


@dataclass(frozen=True)
class WorkItem:
    """What is rendered of a variant in a test scene, by its label; with a `seed`, a reference."""

    scene: str
    character: str
    engine: str
    variant: str = ""
    seed: int = 0

    @property
    def name(self) -> str:
        """What its results are called."""
        what = f"reference_{self.seed}" if self.seed else re.sub(r"\W+", "_", self.variant).strip("_").lower()
        return "/".join(filter(None, (self.scene, self.character, f"{self.engine}_{what}")))


@dataclass(frozen=True)
class JobSpec(Spec):
    """What is asked for. `characters` are by name what `character.load` takes; `hard_inputs`: GLSL and OSL as well."""

    characters: Mapping[str, str]
    engines: tuple[str, ...]
    scenes: tuple[str, ...]
    quick: bool
    hard_inputs: bool

    def variants(self, scene: str) -> list[tuple[str, str]]:
        """Return engine and label of all that is rendered in a test scene, and what is measured beside it."""
        used = [ENGINES[key] for key in self.engines]
        found = [(one.engine.key, one.label) for one in TEST_SCENES[scene].select(used, self.quick)]
        return found + [(engine.key, BESIDE) for engine in run.beside(scene, used)]

    def of_scene(self, scene: str) -> Sequence[str]:
        """Return the characters that a test scene is rendered of; "" where it has none of its own."""
        return tuple(self.characters) if scene == Five.name else ("",)

    def items(self) -> Iterator[WorkItem]:
        """Yield all work items, references before what is held against them."""
        for scene in self.scenes:
            for character in self.of_scene(scene):
                if scene in REFERENCED:
                    yield from (WorkItem(scene, character, CYCLES.key, seed=seed) for seed in REFERENCE_SEEDS)
                yield from (WorkItem(scene, character, engine, label) for engine, label in self.variants(scene))
        if self.hard_inputs:
            yield from (WorkItem(HARD_INPUTS, "", engine, name) for engine, name in TARGETS.items() if engine in self.engines)


def steps(spec: JobSpec) -> list[Step]:
    """Return the steps before collect of the study of error against run time: a task for all sample counts of a variant."""
    found = []
    for scene in spec.scenes:
        characters = [character_range(len(spec.characters))] if len(spec.of_scene(scene)) > 1 else []
        fixed, first = ("--scene", scene), []
        if scene in REFERENCED:
            seeds = [*characters, {"name": "Seed", "type": "INT", "range": list(REFERENCE_SEEDS)}]
            text = "Render what the others are held against, with random numbers of its own each"
            found.append(Step(f"reference {scene}", "reference", text, seeds, fixed=fixed))
            first = [found[-1].name]
        engines, variants = zip(*spec.variants(scene), strict=True)
        combination = " * ".join([*(one["name"] for one in characters), "(Engine, Variant)"])
        parameters = [*characters, one_of("Engine", engines), one_of("Variant", variants)]
        text = "Render a variant with all of its sample counts"
        found.append(Step(f"render {scene}", "render", text, parameters, combination, fixed, first))
    if spec.hard_inputs:
        parameters = [one_of("Engine", (key for key in TARGETS if key in spec.engines))]
        text = "Hold GLSL and OSL against the formulas in all digits"
        found.append(Step(f"render {HARD_INPUTS}", "render", text, parameters, fixed=("--scene", HARD_INPUTS)))
    return found


class ReportJob:
    """Does the tasks of a job of report.py with the engines that run here, and keeps the last test scene."""

    def __init__(self, job: Mapping[str, Any], usable: Sequence[Engine]) -> None:
        self.spec = JobSpec.from_json(job["spec"])
        self.used = [engine for engine in usable if engine.key in self.spec.engines]
        self._scene: TestScene | None = None
        self._built: tuple[str, str] | None = None
        self._build_seconds = 0.0
        self._is_eevee_started = False

    def do(self, step: str, given: Mapping[str, str], results: Results, show: Show) -> None:
        """Render the items that `given` chooses; raises WorkError."""
        of_step = (item for item in self.spec.items() if step == "render" or item.seed)
        items = chosen(of_step, self.spec.characters, given)
        for done, item in enumerate(items):

            def progress(work: float, done: int = done) -> Progress:
                return Progress(work, lambda percent, text: show((100.0 * done + percent) / len(items), text))

            if not results.has(item.name):
                with one_line(item.name):
                    results.keep(item.name, *self._render(item, results, progress))

    def _render(self, item: WorkItem, results: Results, progress: Callable[[float], Progress]) -> Rendered:
        """Return the record and files of an item; `progress(work)` returns the Progress of so much work [s]."""
        engine = ENGINES[item.engine]
        if engine not in self.used:
            raise RuntimeError(f"{engine.label} does not run on this machine")
        notes, files = Notes(), {}
        if item.scene == HARD_INPUTS:
            with progress(run.HARD_WORK).step(f"Hard inputs  {item.variant}", run.HARD_WORK):
                run.hard_inputs(item.variant, notes)
        else:
            scene = self._prepare(item)
            left = self._left(item, scene, engine, notes, results)
            run.run(left, notes, progress(left.seconds))
            about = {"scene": scene.name, "seconds": self._build_seconds, "reference": scene.reference_text}
            notes.add((run.BUILD, scene.name), about)
            if item.seed:
                files["f32"] = notes.picture(run.reference_name(scene, item.seed)).tobytes()
        units = [{"key": key, "record": record} for key, record in notes.units.items()]
        return {"environment": environment([engine]), "units": units}, files

    def _prepare(self, item: WorkItem) -> TestScene:
        """Return the test scene of an item: a new one also for what is measured before its characters get other materials."""
        if self._scene is None or self._built != (item.scene, item.character) or item.variant == BESIDE:
            self._scene = self._built = None
            bpy.ops.wm.read_factory_settings(use_empty=True)
            start = time.perf_counter()
            self._scene = build(item.scene, self.used, self.spec.quick, self.spec.characters.get(item.character, "human"))
            self._build_seconds = time.perf_counter() - start
            self._built = item.scene, item.character
        return self._scene

    def _left(self, item: WorkItem, scene: TestScene, engine: Engine, notes: Notes, results: Results) -> run.Remaining:
        """Return what is to be rendered of an item, EEVEE started and the pictures of the reference noted."""
        if item.seed:
            return run.Remaining(scene, references=[item.seed])
        if item.variant == BESIDE:
            return run.Remaining(scene, beside=[engine])
        units = [unit for unit in run.units(scene) if (unit.variant.engine, unit.variant.label) == (engine, item.variant)]
        if not units:
            raise RuntimeError(f"{engine.label} has no {item.variant} on this machine")
        if engine is EEVEE and not self._is_eevee_started:
            run.start_eevee(scene, notes)
            self._is_eevee_started = True
        if scene.reference:
            for seed in REFERENCE_SEEDS:
                reference = WorkItem(item.scene, item.character, CYCLES.key, seed=seed)
                notes.keep_picture(run.reference_name(scene, seed), array("f", results.read(reference.name, "f32")))
        return run.Remaining(scene, units)

    def collect(self, results: Results, output: OutputFolder) -> list[str]:
        """Write the report of each character into `output`; returns lines to print. Raises Incomplete, BadInput."""
        items = list(self.spec.items())
        results.check(item.name for item in items)
        said = []
        for character in self.spec.characters:
            notes, environments = Notes(), []
            for item in items:
                if item.character in ("", character):
                    record = results.record(item.name)
                    environments.append(record["environment"])
                    notes.units = {tuple(unit["key"]): unit["record"] for unit in record["units"]} | notes.units
            machine, differing = merged(environments)
            asked = document.options(self.spec.quick, self.spec.engines, self.spec.scenes, character)
            about = {"environment": machine, "options": asked, **({"environments": differing} if differing else {})}
            prefix = f"{character}_" if len(self.spec.characters) > 1 else ""
            texts, advice = document.files(about, notes)
            for name, text in texts.items():
                output.write_text(f"{prefix}{name}", text)
            said += [f"{prefix}{line}" for line in advice]
        return [*said, f"Wrote {', '.join(output.publish())} to {output.target}"]
