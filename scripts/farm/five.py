# SPDX-License-Identifier: GPL-3.0-or-later
"""The five-character comparison in parts: each look of a character, and the picture of all, by frame and engine.

Those who do parts keep the scene of the last character, so that it is built once and not for every part. What Cycles and Realtime
come to is held against each other when all is collected.
"""

import os
import shutil
import tempfile
from array import array
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from statistics import median

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import CYCLES, ENGINES, REALTIME, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.quality import CHOSEN_LIGHTS
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.addon.optimize.materials import OptimizedNode, optimize_materials, restore_materials
from true_diffuse.addon.probe.environment import environment, merged
from true_diffuse.scenes import five_characters
from true_diffuse.scripts.characters import character as characters
from true_diffuse.scripts.farm.parts import Made, check_runs, keep_part
from true_diffuse.scripts.farm.results import Results
from true_diffuse.scripts.studies import five, pictures

PICTURE, ERROR_MAP = "picture", "error_map"  # beside the looks' names
PICTURE_SUFFIXES = ("png", "exr")
MAP_WORK = 1.0
CHUNK = 8

type Frame = int | None  # None is the frame that a file was saved at


@dataclass(frozen=True)
class Way:
    """How the rough characters are rendered in an engine where that was picked; Realtime has no modes."""

    mode: str | None
    osl: bool


@dataclass(frozen=True)
class Order:
    """What is ordered. `characters` are by name what `scenes.character.load` takes; `samples` and `ways` by an engine's key."""

    characters: Mapping[str, str]
    frames: tuple[Frame, ...]
    engines: tuple[str, ...]
    samples: Mapping[str, int]
    resolution: tuple[int, int]
    sigmas: tuple[float, ...]
    albedo: float
    full_figure: bool
    leave_out: bool
    ways: Mapping[str, Way]
    chunk: int = CHUNK
    """How many frames' meshes whoever does parts keeps at a time."""

    def packed(self) -> Record:
        """Return it as JSON holds it."""
        return asdict(self)

    @staticmethod
    def unpacked(record: Record) -> "Order":
        """Return what `packed` made a record of."""
        values: Record = {**record, "ways": {key: Way(**way) for key, way in record["ways"].items()}}
        for name in ("frames", "engines", "resolution", "sigmas"):
            values[name] = tuple(record[name])
        return Order(**values)

    @property
    def looks(self) -> tuple[str, ...]:
        """The picture of all, and the looks that are measured."""
        return (PICTURE, *self.measured)

    @property
    def measured(self) -> tuple[str, ...]:
        """The looks that are measured."""
        return tuple(look.name for look in five_characters.looks(self.sigmas))

    @property
    def holds(self) -> bool:
        """Whether Realtime is held against Cycles."""
        return {CYCLES.key, REALTIME.key} <= set(self.engines)

    @property
    def holds_osl(self) -> bool:
        """Whether also against Cycles with OSL, on machines that compile it."""
        return self.holds and not self.ways

    def parts(self) -> Iterator["Part"]:
        """Yield all parts: by character, frame, engine, look; last the error map, which is made of what the looks came to."""
        for character in self.characters:
            for frame in self.frames:
                for engine in self.engines:
                    for look in (*self.looks, ERROR_MAP):
                        yield Part(character, frame, engine, look)

    def chunks(self) -> Iterator[list["Part"]]:
        """Yield all parts, those together that whoever does them needs the same meshes for, an engine's after another's."""
        for character in self.characters:
            for first in range(0, len(self.frames), self.chunk):
                frames = self.frames[first : first + self.chunk]
                looks = (*self.looks, ERROR_MAP)
                yield [Part(character, frame, engine, look) for engine in self.engines for frame in frames for look in looks]

    def pictures(self) -> Iterator["Part"]:
        """Yield the parts that are pictures."""
        return (part for part in self.parts() if part.look == PICTURE)

    def prefix(self, part: "Part") -> str:
        """Return what the names of a picture begin with, as far as there are others."""
        character = f"{part.character}_" if len(self.characters) > 1 else ""
        return character if part.frame is None else f"{character}{part.frame:04d}_"

    def work(self) -> float:
        """Return the work of all, in the units that `Five` reports to a `Progress`."""
        scenes = len(self.characters) * len(self.frames)
        looks = len(self.measured)
        each = pictures.PICTURE_WORK + five.MEASUREMENT_WORK * looks + MAP_WORK
        shown = five_characters.looks(self.sigmas)
        more = self.holds_osl * sum(map(five.has_osl, shown)) + self.holds * sum(map(five.is_approximated, shown))
        return scenes * (len(self.engines) * each + five.MEASUREMENT_WORK * (looks + more))


@dataclass(frozen=True)
class Part:
    """A picture, or what is measured of one look."""

    character: str
    frame: Frame
    engine: str
    look: str

    @property
    def name(self) -> str:
        """What its results are called."""
        frame = "still" if self.frame is None else f"{self.frame:04d}"
        return f"{self.character}/{frame}/{self.engine}_{self.look}"

    @property
    def work(self) -> float:
        """The most work that `Five` reports of it to a `Progress`."""
        measured = 3.0 if self.engine == CYCLES.key else 2.0  # Cycles with OSL, or in mode Lamps
        return {PICTURE: pictures.PICTURE_WORK, ERROR_MAP: MAP_WORK}.get(self.look, measured * five.MEASUREMENT_WORK)


def rendered(
    scene: bpy.types.Scene, engine: Engine, samples: int, captions: pictures.Captions, progress: Progress, denoise: bool = False
) -> tuple[float, dict[str, bytes]]:
    """Return how long a picture took [s], and what its files hold, by suffix."""
    with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
        target = Path(folder) / "picture"
        seconds = pictures.render_picture(scene, engine, samples, target, captions, progress, denoise)
        return seconds, {suffix: target.with_name(f"picture_{engine.key}.{suffix}").read_bytes() for suffix in PICTURE_SUFFIXES}


class Five:
    """Who does parts of an `order` with the engines that run here, and keeps the scene of the last character and its frames."""

    def __init__(self, order: Order, usable: Sequence[Engine]) -> None:
        self.order = order
        self.usable = usable
        self.left_out: dict[str, list[OptimizedNode]] = {}  # by engines' labels, as found last
        self.stage: five_characters.FiveCharacters | None = None
        self._character: str | None = None
        self._engine: Engine | None = None
        self._meshes: Mapping[Frame, bpy.types.Mesh] = {}
        self._seen: dict[tuple[Frame, str], five.Reference] = {}

    def do(self, parts: Sequence[Part], results: Results, progress: Progress) -> None:
        """Do those of the `parts`, of one character, that are not done yet, and keep what they come to.

        Raises BatchError where the character cannot be had, the engine does not run here, or results cannot be kept.
        """
        for part in parts:
            keep_part(part.name, results, partial(self._make, part, [other.frame for other in parts], results, progress))

    def _make(self, part: Part, frames: Sequence[Frame], results: Results, progress: Progress) -> Made:
        engine = ENGINES[part.engine]
        if part.look == ERROR_MAP:
            return self._error_map(part, engine, results, progress)
        check_runs(engine, self.usable)
        self._prepare(part, frames, engine)
        record, files = self._picture(engine, progress) if part.look == PICTURE else self._measured(part, engine, progress)
        return {"environment": environment([engine]), **record}, files

    def _prepare(self, part: Part, frames: Sequence[Frame], engine: Engine) -> None:
        """Have the scene show the frame of a part, ready for an engine."""
        if part.character != self._character or part.frame not in self._meshes:
            self._build(part.character, tuple(dict.fromkeys((self.order.frames[0], *frames))))
        assert self.stage is not None
        for character in self.stage.characters:
            character.subject.data = self._meshes[part.frame]
        self.stage.scene.view_layers[0].update()
        if engine is not self._engine:
            restore_materials()
            if way := self.order.ways.get(engine.key):
                self._choose(way)
            engines.use(self.stage.scene, engine, self.order.samples[engine.key])
            self.left_out[engine.label] = left_out(engine) if self.order.leave_out else []
            self._engine = engine

    def _build(self, character: str, frames: Sequence[Frame]) -> None:
        self.stage = self._character = self._engine = None
        self._meshes = {}
        self._seen.clear()
        bpy.ops.wm.read_factory_settings(use_empty=True)
        order, who = self.order, self.order.characters[character]
        self._meshes = characters.load_frames(who, frames)
        bust = who == "human" and not order.full_figure
        # the frame's camera is that of the first of all frames, so that it stands still
        self.stage = five_characters.build(self._meshes[order.frames[0]], order.albedo, bust, order.resolution, order.sigmas)
        self._character = character

    def _choose(self, way: Way) -> None:
        """Set the characters' mode to what was picked."""
        assert self.stage is not None
        for character in self.stage.characters:
            if character.look.group is ROUGH_DIFFUSE:
                tree = character.subject.material_slots[0].material.node_tree
                if way.mode is not None:
                    tree.nodes[ROUGH_DIFFUSE.name].inputs["Quality"].default_value = way.mode
        chosen_lights.choose([self.stage.key])
        self.stage.scene.cycles.shading_system = way.osl

    def _picture(self, engine: Engine, progress: Progress) -> Made:
        assert self.stage is not None
        samples = self.order.samples[engine.key]
        seconds, files = rendered(self.stage.scene, engine, samples, five.captions(self.stage), progress)
        return {"engine": engine.key, "samples": samples, "render_seconds": seconds}, files

    def _measured(self, part: Part, engine: Engine, progress: Progress) -> Made:
        assert self.stage is not None
        only = replace(self.stage, characters=tuple(one for one in self.stage.characters if one.look.name == part.look))
        key = part.frame, part.look
        if key not in self._seen:
            (self._seen[key],) = five.references(only, progress)
        seen = [self._seen[key]]
        (one,) = five.measure(only, seen, engine, self.order.samples[engine.key], progress)
        found = {"measured": {"character": part.character, "frame": part.frame, **five.record(one, self.order.albedo)}}
        files = {"patch": five.patch(self.stage, one).to_bytes()}
        if self.order.holds and engine in (CYCLES, REALTIME):
            takes = [(None, one)]
            if engine is CYCLES:
                restore_materials()
                self._engine = None  # what comes next has its materials simplified again
                if self.order.holds_osl and compiles_osl():
                    takes += [(None, take) for take in five.measure_osl(only, seen, progress)]
                takes += [(CHOSEN_LIGHTS, take) for take in five.measure_chosen_lights(only, seen, one.samples, progress)]
            found["takes"] = [{"osl": take.osl, "mode": mode, "samples": take.samples} for mode, take in takes]
            files |= {f"{k}.f32": take.rgb.tobytes() for k, (_, take) in enumerate(takes)}
            files["i32"] = array("i", one.reference.expected.pixels).tobytes()
        return found, files

    def _error_map(self, part: Part, engine: Engine, results: Results, progress: Progress) -> Made:
        patches = []
        with progress.step(f"Error map  {engine.label}", MAP_WORK), tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
            for look in self.order.measured:
                name = replace(part, look=look).name
                results.record(name)
                patches.append(five.Patch.from_bytes(results.file(name, "patch").read_bytes()))
            path = Path(folder) / "error.png"
            five.write_error_map(path, engine.label, self.order.resolution, patches)
            return {}, {"png": path.read_bytes()}


@dataclass(frozen=True)
class Collected:
    """What the parts come to: a record for each look, and what they were made with."""

    records: list[Record]
    environment: Record
    environments: list[Record]
    """Where machines differ, those of all of them."""
    pictures: list[Record] = field(default_factory=list)
    """How they were rendered, where that is told."""
    realtime_from_cycles: list[Record] = field(default_factory=list)
    """How far they are from each other, for each look, where both are."""

    @property
    def document(self) -> Record:
        """What compare.json holds beside the options."""
        names = ("environments", "pictures", "realtime_from_cycles")
        others = {name: getattr(self, name) for name in names}
        return {"records": self.records, "environment": self.environment} | {name: each for name, each in others.items() if each}


def collect(order: Order, results: Results, folder: Path) -> Collected:
    """Write all pictures and error maps into `folder`, and return the rest; raises Incomplete where parts are not there whole."""
    parts = list(order.parts())
    found = dict(zip(parts, results.records(part.name for part in parts), strict=True))
    for shown in order.pictures():
        for suffix in PICTURE_SUFFIXES:
            copy(results.file(shown.name, suffix), folder / f"{order.prefix(shown)}five_{shown.engine}.{suffix}")
        error_map = results.file(replace(shown, look=ERROR_MAP).name, "png")
        copy(error_map, folder / f"{order.prefix(shown)}error_{shown.engine}.png")
    records = [record["measured"] for record in found.values() if "measured" in record]
    made = merged([record["environment"] for record in found.values() if "environment" in record])
    held = [record for part in parts if order.holds for record in _held(part, found, results)]
    return Collected(records, *made, realtime_from_cycles=held)


def _held(part: Part, found: Mapping[Part, Record], results: Results) -> Iterator[Record]:
    """Yield how far a look in Realtime is from each take of Cycles; nothing of other parts."""
    if part.engine != REALTIME.key or "takes" not in found[part]:
        return
    cycles = replace(part, engine=CYCLES.key)
    realtime, pixels = floats(results.file(part.name, "0.f32")), array("i", results.file(cycles.name, "i32").read_bytes())
    for k, take in enumerate(found[cycles]["takes"]):
        rgb = floats(results.file(cycles.name, f"{k}.f32"))
        difference = five.realtime_difference(
            realtime, five.CyclesReference(take["osl"], take["mode"], take["samples"], pixels, rgb)
        )
        yield {"character": part.character, "frame": part.frame, "name": part.look, **difference}


def summary(found: Collected) -> list[str]:
    """Return a line for each engine and look: its error over all characters and frames; and for Realtime from Cycles."""
    shares: dict[str, list[float]] = {}
    for one in found.records:
        if one["rms_error"] is not None:
            shares.setdefault(f"{ENGINES[one['engine']].label}, {one['name']}: RMS error", []).append(one["rms_error"])
    for one in found.realtime_from_cycles:
        if one["rms_difference"] is not None:
            text = f"Realtime from {five.reference_name(one)}, {one['name']}: RMS difference"
            shares.setdefault(text, []).append(one["rms_difference"])
    return [
        f"{text} {five.percent(median(each))} (median of {len(each)}), {five.percent(min(each))} to {five.percent(max(each))}"
        for text, each in shares.items()
    ]


def left_out(engine: Engine) -> list[OptimizedNode]:
    """Have all materials render by the least that `engine` needs; returns what was found.

    Realtime takes a material's values, not its nodes, whatever was left out of them.
    """
    return [] if engine is REALTIME else optimize_materials()


def floats(path: Path) -> array[float]:
    """Return the 32-bit floats of a file."""
    return array("f", path.read_bytes())


def copy(source: Path, target: Path) -> None:
    """Make `target` the same file as `source`, or a copy where the disk cannot have one file twice."""
    with suppress(OSError):
        os.link(source, target)
        return
    shutil.copyfile(source, target)
