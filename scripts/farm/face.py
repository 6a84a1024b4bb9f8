# SPDX-License-Identifier: GPL-3.0-or-later
"""The face's comparison in parts: each head, and the picture of all, by engine.

What the engines' heads come to is held against each other when all is collected.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import ENGINES, Engine
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.optimize.materials import OptimizedNode, restore_materials
from true_diffuse.addon.probe.environment import environment, merged
from true_diffuse.scripts.characters import character as characters
from true_diffuse.scripts.characters import face as scene
from true_diffuse.scripts.farm.five import PICTURE, PICTURE_SUFFIXES, Collected, Part, copy, floats, left_out, rendered
from true_diffuse.scripts.farm.parts import Made, check_runs, keep_part
from true_diffuse.scripts.farm.results import Results
from true_diffuse.scripts.studies import face, pictures
from true_diffuse.scripts.studies.five import MEASUREMENT_WORK

LOOKS = {look.name: look for look in scene.LOOKS}


@dataclass(frozen=True)
class Order:
    """What is ordered. `characters` are by name what `scenes.character.load` takes; `samples` by an engine's key."""

    characters: Mapping[str, str]
    engines: tuple[str, ...]
    samples: Mapping[str, int]
    resolution: tuple[int, int]
    leave_out: bool

    frames = (None,)
    looks = (PICTURE, *LOOKS)

    def packed(self) -> Record:
        """Return it as JSON holds it."""
        return asdict(self)

    @staticmethod
    def unpacked(record: Record) -> "Order":
        """Return what `packed` made a record of."""
        values: Record = {**record, "engines": tuple(record["engines"]), "resolution": tuple(record["resolution"])}
        return Order(**values)

    def chunks(self) -> Iterator[list[Part]]:
        """Yield all parts, those of a character together."""
        for character in self.characters:
            yield [Part(character, None, engine, look) for engine in self.engines for look in self.looks]

    def work(self) -> float:
        """Return the work of all, in the units that `Face` reports to a `Progress`."""
        takes = sum(face.REPEATS[ENGINES[key]] for key in self.engines)
        each = len(self.engines) * pictures.PICTURE_WORK + (takes + 1) * MEASUREMENT_WORK * len(LOOKS)
        return len(self.characters) * each

    def prefix(self, character: str) -> str:
        """Return what the names of a character's pictures begin with, as far as there are others."""
        return f"{character}_" if len(self.characters) > 1 else ""


class Face:
    """Who does parts of an `order` with the engines that run here, and keeps the scene of the last character."""

    def __init__(self, order: Order, usable: Sequence[Engine]) -> None:
        self.order = order
        self.usable = usable
        self.left_out: dict[str, list[OptimizedNode]] = {}  # by engines' labels, as found last
        self.stage: scene.Face | None = None
        self._character: str | None = None
        self._engine: Engine | None = None
        self._seen: dict[str, face.VisibleRegions] = {}

    def do(self, parts: Sequence[Part], results: Results, progress: Progress) -> None:
        """Do those of the `parts`, of one character, that are not done yet, and keep what they come to.

        Raises BatchError where the character cannot be had, the engine does not run here, or results cannot be kept.
        """
        for part in parts:
            keep_part(part.name, results, partial(self._make, part, progress))

    def _make(self, part: Part, progress: Progress) -> Made:
        engine = ENGINES[part.engine]
        check_runs(engine, self.usable)
        stage = self._prepare(part, engine)
        do = self._picture if part.look == PICTURE else self._measured
        record, files = do(stage, part, engine, progress)
        return {"environment": environment([engine]), **record}, files

    def _prepare(self, part: Part, engine: Engine) -> scene.Face:
        """Return the scene of a part, ready for an engine."""
        if self.stage is None or part.character != self._character:
            self.stage = self._character = self._engine = None
            self._seen.clear()
            bpy.ops.wm.read_factory_settings(use_empty=True)
            who = self.order.characters[part.character]
            self.stage = scene.build(characters.load(who), who == "human", self.order.resolution)
            self._character = part.character
        if engine is not self._engine:
            restore_materials()
            engines.use(self.stage.scene, engine, self.order.samples[engine.key])
            self.left_out[engine.label] = left_out(engine) if self.order.leave_out else []
            self._engine = engine
        return self.stage

    def _picture(self, stage: scene.Face, part: Part, engine: Engine, progress: Progress) -> Made:
        samples, denoise = self.order.samples[engine.key], engine is engines.CYCLES
        seconds, files = rendered(stage.scene, engine, samples, face.captions(stage), progress, denoise)
        made = {"engine": engine.key, "samples": samples, "denoised": denoise, "render_seconds": seconds}
        return {"picture": {"character": part.character, **made}}, files

    def _measured(self, stage: scene.Face, part: Part, engine: Engine, progress: Progress) -> Made:
        only = replace(stage, heads=tuple(head for head in stage.heads if head.look.name == part.look))
        if part.look not in self._seen:
            (self._seen[part.look],) = face.visible_regions(only, progress)
        samples = self.order.samples[engine.key]
        (one,) = face.measure(only, engine, samples, progress)
        files = {f"{take}.f32": rgb.tobytes() for take, rgb in enumerate(one.repeats)}
        return {"samples": samples, "seconds": one.seconds, "regions": self._seen[part.look].pixels}, files


def collect(order: Order, results: Results, folder: Path) -> Collected:
    """Write all pictures into `folder`, and return the rest; raises Incomplete where parts are not there whole."""
    parts = [part for chunk in order.chunks() for part in chunk]
    found = dict(zip(parts, results.records(part.name for part in parts), strict=True))
    records, shown = [], []
    for character in order.characters:
        seen: dict[str, face.VisibleRegions] = {}
        measured = []
        for part in (part for part in parts if part.character == character):
            record, engine = found[part], ENGINES[part.engine]
            if part.look == PICTURE:
                shown.append(record["picture"])
                for suffix in PICTURE_SUFFIXES:
                    copy(results.file(part.name, suffix), folder / f"{order.prefix(character)}face_{engine.key}.{suffix}")
                continue
            look = LOOKS[part.look]
            seen[part.look] = face.VisibleRegions(look, record["regions"])
            takes = tuple(floats(results.file(part.name, f"{take}.f32")) for take in range(face.REPEATS[engine]))
            measured.append(face.Measurement(look, engine, record["samples"], record["seconds"], takes))
        records += [{"character": character, **record} for record in face.records(list(seen.values()), measured)]
    return Collected(records, *merged([record["environment"] for record in found.values()]), shown)


def summary(found: Collected) -> list[str]:
    """Return a line for each head's front: how far the other engines are from Cycles, for people."""
    fronts = [record for record in found.records if record["region"] == face.FRONT_LIT]
    return [
        f"{one['character']}, {one['look']}: {ENGINES[key].label} {100.0 * share:.2f} % from Cycles, front-lit"
        for one in fronts
        for key, share in one["rms_difference"].items()
        if share is not None
    ]
