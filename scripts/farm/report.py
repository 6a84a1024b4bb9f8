# SPDX-License-Identifier: GPL-3.0-or-later
"""The study of error against run time in parts: a contestant's renders in a scene, the references that some are held against, and
what is measured beside them.

Those who do parts keep the last scene, so that it is built once and not for every part. The scene "five" is rendered of every
character; the others are of no character or of our own head.
"""

import re
import time
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, ENGINES, Engine
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.probe.environment import environment, merged
from true_diffuse.scripts.characters import character as characters
from true_diffuse.scripts.farm.parts import Made, check_runs, keep_part
from true_diffuse.scripts.farm.results import BatchError, Results
from true_diffuse.scripts.studies.work_precision import run
from true_diffuse.scripts.studies.work_precision.journal import Notes
from true_diffuse.scripts.studies.work_precision.test_scenes import REFERENCE_SEEDS, STAGES, FaceStage, Five, Furnace, Sphere, Stage

BESIDE = "beside"  # what is measured beside the contestants
SHADERS = "shaders"  # in place of a scene: what GLSL and OSL make of hard inputs
WORK, LEAST_WORK = 15.0, 1e-9  # [s], of hard inputs, roughly; of nothing


@dataclass(frozen=True)
class Order:
    """What is ordered. `characters` are by name what `scenes.character.load` takes; `hard`: hard inputs as well."""

    characters: Mapping[str, str]
    engines: tuple[str, ...]
    scenes: tuple[str, ...]
    quick: bool
    hard: bool

    def packed(self) -> Record:
        """Return it as JSON holds it."""
        return asdict(self)

    @staticmethod
    def unpacked(record: Record) -> "Order":
        """Return what `packed` made a record of."""
        values: Record = {**record, "engines": tuple(record["engines"]), "scenes": tuple(record["scenes"])}
        return Order(**values)

    def cast(self, scene: str) -> list[tuple[str, str]]:
        """Return engine and label of all that is rendered in a scene, and what is measured beside it."""
        used = [ENGINES[key] for key in self.engines]
        found = [(one.engine.key, one.label) for one in STAGES[scene].cast(used, self.quick)]
        if scene == Five.name:
            found += [(engine.key, BESIDE) for engine in used]
        if scene == Sphere.name and EEVEE in used:
            found.append((EEVEE.key, BESIDE))
        return found

    def of_scene(self, scene: str) -> Sequence[str]:
        """Return the characters that a scene is rendered of; "" where it has none of its own."""
        return tuple(self.characters) if scene == Five.name else ("",)

    def parts(self) -> Iterator["Part"]:
        """Yield all parts, references before what is held against them."""
        for scene in self.scenes:
            for character in self.of_scene(scene):
                if scene in REFERENCED:
                    yield from (Part(scene, character, CYCLES.key, seed=seed) for seed in REFERENCE_SEEDS)
                yield from (Part(scene, character, engine, label) for engine, label in self.cast(scene))
        if self.hard:
            yield from (Part(SHADERS, "", engine, home) for engine, home in HOMES.items() if engine in self.engines)


REFERENCED = (Five.name, FaceStage.name)
HOMES = {EEVEE.key: "GLSL", CYCLES.key: "OSL"}


@dataclass(frozen=True)
class Part:
    """What is rendered of a contestant in a scene, by its label; with a `seed`, a reference."""

    scene: str
    character: str
    engine: str
    label: str = ""
    seed: int = 0

    @property
    def name(self) -> str:
        """What its results are called."""
        what = f"reference_{self.seed}" if self.seed else re.sub(r"\W+", "_", self.label).strip("_").lower()
        return "/".join(filter(None, (self.scene, self.character, f"{self.engine}_{what}")))


class Study:
    """Who does parts of an `order` with the engines that run here, and keeps the last scene."""

    def __init__(self, order: Order, usable: Sequence[Engine]) -> None:
        self.order = order
        self.used = [engine for engine in usable if engine.key in order.engines]
        self._stage: Stage | None = None
        self._place: tuple[str, str] | None = None
        self._build_seconds = 0.0
        self._is_eevee_started = False

    def do(self, part: Part, results: Results, told: Callable[[float], Progress]) -> None:
        """Do a part that is not done yet, and keep what it comes to; `told` of its work [s] is who wants to know how far it is.

        Raises BatchError where its engine or contestant does not run here, a reference is not there or results cannot be kept.
        """
        keep_part(part.name, results, partial(self._make, part, results, told))

    def _make(self, part: Part, results: Results, told: Callable[[float], Progress]) -> Made:
        engine = ENGINES[part.engine]
        check_runs(engine, self.used)
        notes, files = Notes(), {}
        if part.scene == SHADERS:
            with told(WORK).step(f"Hard inputs  {part.label}", WORK):
                run.hard_inputs(part.label, notes)
        else:
            stage = self._prepare(part)
            self._render(part, stage, notes, results, told)
            build = {"scene": stage.name, "seconds": self._build_seconds, "reference": stage.reference_text}
            notes.add(("build", stage.name), build)
            if part.seed:
                files["f32"] = notes.picture(run.reference_name(stage, part.seed)).tobytes()
        units = [{"key": key, "record": record} for key, record in notes.units.items()]
        return {"environment": environment([engine]), "units": units}, files

    def _prepare(self, part: Part) -> Stage:
        """Return the scene of a part: a new one also for what is measured before its characters get other materials."""
        if self._stage is None or self._place != (part.scene, part.character) or part.label == BESIDE:
            self._stage = self._place = None
            bpy.ops.wm.read_factory_settings(use_empty=True)
            start = time.perf_counter()
            self._stage = self._build(part)
            self._build_seconds = time.perf_counter() - start
            self._place = part.scene, part.character
        return self._stage

    def _build(self, part: Part) -> Stage:
        quick, who = self.order.quick, self.order.characters.get(part.character, "human")
        if part.scene == Five.name:
            return Five(self.used, quick, characters.load(who), bust=who == "human")
        if part.scene == FaceStage.name:
            return FaceStage(self.used, quick, characters.load(who))
        return {Sphere.name: Sphere, Furnace.name: Furnace}[part.scene](self.used, quick)

    def _render(self, part: Part, stage: Stage, notes: Notes, results: Results, told: Callable[[float], Progress]) -> None:
        engine = ENGINES[part.engine]
        if part.seed or part.label == BESIDE:
            left = run.Part(stage, [], [part.seed] if part.seed else [], [])
            used = [engine] if part.label == BESIDE else []
            run.do(left, used, notes, told(run.work([left], used, notes) + LEAST_WORK))
            return
        units = [unit for unit in run.units(stage) if (unit.contestant.engine, unit.contestant.label) == (engine, part.label)]
        if not units:
            raise BatchError(f"{part.name}: {engine.label} has no {part.label} on this machine")
        if engine is EEVEE and not self._is_eevee_started:
            run.start_eevee(stage, notes)
            self._is_eevee_started = True
        if stage.reference:
            for seed in REFERENCE_SEEDS:
                picture = array("f")
                reference = Part(part.scene, part.character, CYCLES.key, seed=seed)
                results.record(reference.name)
                picture.frombytes(results.file(reference.name, "f32").read_bytes())
                notes.keep_picture(run.reference_name(stage, seed), picture)
        left = run.Part(stage, units, [], [units[0].contestant])
        run.do(left, [], notes, told(run.work([left], [], notes)))


@dataclass(frozen=True)
class Collected:
    """What the parts of one character, and those of none, come to: `environments` where machines differ, those of all of them."""

    notes: Notes
    environment: Record
    environments: list[Record]


def collect(order: Order, results: Results) -> dict[str, Collected]:
    """Return what the parts come to, by character; raises Incomplete where parts are missing or damaged."""
    parts = list(order.parts())
    found = dict(zip(parts, results.records(part.name for part in parts), strict=True))
    collected = {}
    for character in order.characters:
        notes = Notes()
        ours = [record for part, record in found.items() if part.character in ("", character)]
        for record in ours:
            for unit in record["units"]:
                if tuple(unit["key"]) not in notes.units:
                    notes.add(tuple(unit["key"]), unit["record"])
        collected[character] = Collected(notes, *merged([record["environment"] for record in ours]))
    return collected
