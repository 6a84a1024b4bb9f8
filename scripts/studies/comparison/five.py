# SPDX-License-Identifier: GPL-3.0-or-later
"""The five characters: each look against its model, and Realtime against Cycles where both are rendered."""

import tempfile
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median

import bpy

from true_diffuse.addon.blender.engines import CYCLES, ENGINES, REALTIME, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.quality import CHOSEN_LIGHTS
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.scenes import five_characters
from true_diffuse.scenes.subject import Figure
from true_diffuse.scripts.characters import character as characters
from true_diffuse.scripts.studies import five, pictures
from true_diffuse.scripts.studies.comparison import base
from true_diffuse.scripts.studies.comparison.base import ERROR_MAP, PICTURE, PICTURE_SUFFIXES, Frame, WorkItem
from true_diffuse.scripts.studies.comparison.outcomes import Outcomes, Rendered

MAP_WORK = 1.0
MEASURED = "measured"  # the outfit beside PICTURE
MEASURED_NOTE = "errors are those of its diffuse reflection: where a pixel is opaque, no metal and no light, without layers above"


@dataclass(frozen=True)
class Configuration:
    """How the rough characters are rendered in an engine where that was picked; Realtime has no quality to choose."""

    quality: str | None
    osl: bool


@dataclass(frozen=True, kw_only=True)
class JobSpec(base.JobSpec):
    """As the base has it; `configurations` by an engine's key, of which a job has none."""

    sigmas: tuple[float, ...]
    albedo: float
    full_figure: bool
    plaster: bool
    """Whether files are shown as one mesh of one color."""
    configurations: Mapping[str, Configuration]

    maps = (ERROR_MAP,)

    @property
    def measured(self) -> tuple[str, ...]:
        return tuple(look.name for look in five_characters.looks(self.sigmas))

    @property
    def compares_realtime(self) -> bool:
        """Whether Realtime is compared with Cycles."""
        return {CYCLES.key, REALTIME.key} <= set(self.engines)

    @property
    def compares_osl(self) -> bool:
        """Whether also with Cycles with OSL, on machines that compile it."""
        return self.compares_realtime and not self.configurations

    def work(self, item: WorkItem) -> float:
        if item.look in (PICTURE, ERROR_MAP):
            return {PICTURE: pictures.PICTURE_WORK, ERROR_MAP: MAP_WORK}[item.look]
        look = next(look for look in five_characters.looks(self.sigmas) if look.name == item.look)
        takes = 1 + (item.engine == self.engines[0])  # what the camera sees is worked out for the first engine alone
        if item.engine == CYCLES.key:
            takes += self.compares_osl * five.has_osl(look) + self.compares_realtime * five.is_approximated(look)
        return takes * five.MEASUREMENT_WORK


class Renderer(base.Renderer[JobSpec]):
    """As the base has it; keeps the meshes of the last frames, too."""

    _five: five_characters.FiveCharacters
    _meshes: Mapping[Frame, bpy.types.Mesh]
    _figures: Mapping[Frame, Figure]
    _seen: dict[tuple[Frame, str], five.Reference]

    def build(self, character: str, frames: Sequence[Frame]) -> bpy.types.Scene:
        spec, who = self.spec, self.spec.characters[character]
        # the frame's camera is that of the first of all frames, so that it stands still
        all_frames = tuple(dict.fromkeys((spec.frames[0], *frames)))
        self._meshes, self._figures = {}, {}
        if who in characters.INCLUDED or spec.plaster:
            self._meshes = characters.load_frames(who, all_frames, self.notes.append)
            bust = who == "human" and not spec.full_figure
            self._five = five_characters.build(self._meshes[spec.frames[0]], spec.albedo, bust, spec.resolution, spec.sigmas)
        else:
            self._figures = characters.load_figures(characters.check_file(who), all_frames, self.notes.append)
            self._five = five_characters.build_as_is(tuple(self._figures.values()), spec.resolution, spec.sigmas)
            self.notes += [*self._five.notes, MEASURED_NOTE]
        self._shown: Frame | str = "nothing"
        self._seen = {}
        return self._five.scene

    def show(self, frame: Frame) -> None:
        if frame == self._shown:
            return
        self._shown = frame
        if self._figures:
            five_characters.pose(self._five, self._figures[frame])
            self.engine = None  # the new parts wear what the picture shows
        for character in self._five.characters if self._meshes else ():
            character.subject.data = self._meshes[frame]
        self._five.scene.view_layers[0].update()

    def outfit(self, look: str) -> str:
        if not self._figures:
            return ""
        return MEASURED if look in self.spec.measured else PICTURE

    def wear(self, outfit: str) -> None:
        for character in self._five.characters:
            if character.materials:
                character.wear(character.materials.measured if outfit == MEASURED else character.materials.shown)

    def configure(self, engine: Engine) -> None:
        configuration = self.spec.configurations.get(engine.key)
        if configuration is None:
            return
        for character in self._five.characters:
            if character.look.group is ROUGH_DIFFUSE and configuration.quality is not None:
                for node in five.group_nodes(character):
                    node.inputs["Quality"].default_value = configuration.quality
        chosen_lights.choose([self._five.key])
        self._five.scene.cycles.shading_system = configuration.osl

    @property
    def stage(self) -> five_characters.FiveCharacters:
        """The characters of the scene, as they were shown last."""
        return self._five

    def captions(self) -> pictures.Captions:
        return five.captions(self._five)

    def measure(self, item: WorkItem, engine: Engine, progress: Progress) -> Rendered:
        spec = self.spec
        only = replace(self._five, characters=tuple(one for one in self._five.characters if one.look.name == item.look))
        key = item.frame, item.look
        if key not in self._seen:
            (self._seen[key],) = five.references(only, progress)
        seen = [self._seen[key]]
        (measured,) = five.measure(only, seen, engine, spec.samples[engine.key], progress)
        record = {"measured": {"character": item.character, "frame": item.frame, **five.record(measured, spec.albedo)}}
        files = {"patch": five.patch(self._five, measured).to_bytes()}
        if spec.compares_realtime and engine in (CYCLES, REALTIME):
            takes = [(None, measured)]
            if engine is CYCLES:
                if spec.compares_osl and compiles_osl():
                    takes += [(None, take) for take in five.measure_osl(only, seen, progress)]
                takes += [(CHOSEN_LIGHTS, take) for take in five.measure_chosen_lights(only, seen, measured.samples, progress)]
            record["takes"] = [{"osl": take.osl, "quality": quality, "samples": take.samples} for quality, take in takes]
            files |= {f"{k}.f32": take.rgb.tobytes() for k, (_, take) in enumerate(takes)}
            files["i32"] = array("i", measured.reference.expected.pixels).tobytes()
        return record, files

    def draw_map(self, item: WorkItem, outcomes: Outcomes, progress: Progress) -> Rendered:
        label = ENGINES[item.engine].label
        with progress.step(f"Error map  {label}", MAP_WORK), tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
            names = [replace(item, look=look).name for look in self.spec.measured]
            patches = [five.Patch.from_bytes(outcomes.read(name, "patch")) for name in names]
            path = Path(folder) / "error.png"
            five.write_error_map(path, label, self.spec.resolution, patches)
            return {}, {"png": path.read_bytes()}

    def collect(self, items: Sequence[WorkItem], outcomes: Outcomes, folder: Path, collected: base.Collected) -> None:
        for item in sorted(items, key=lambda item: item.frame or 0):  # frame by frame, each in all engines
            record, prefix = outcomes.record(item.name), self.spec.prefix(item)
            if item.look == PICTURE:
                collected.note(item.character, record["notes"])
                for suffix in PICTURE_SUFFIXES:
                    (folder / f"{prefix}five_{item.engine}.{suffix}").write_bytes(outcomes.read(item.name, suffix))
            elif item.look == ERROR_MAP:
                (folder / f"{prefix}error_{item.engine}.png").write_bytes(outcomes.read(item.name, "png"))
            else:
                collected.records.append(record["measured"])
                if self.spec.compares_realtime and item.engine == REALTIME.key:
                    collected.realtime_from_cycles += _from_cycles(item, outcomes)
            collected.environments += [record["environment"]] if "environment" in record else []

    def summary(self, collected: base.Collected) -> list[str]:
        """Return a line for each engine and look: its error over all characters and frames; and for Realtime from Cycles."""
        errors: dict[str, list[float]] = {}
        for one in collected.records:
            if one["rms_error"] is not None:
                errors.setdefault(f"{ENGINES[one['engine']].label}, {one['name']}: RMS error", []).append(one["rms_error"])
        for one in collected.realtime_from_cycles:
            if one["rms_difference"] is not None:
                text = f"Realtime from {five.reference_name(one)}, {one['name']}: RMS difference"
                errors.setdefault(text, []).append(one["rms_difference"])
        return [
            f"{text} {five.percent(median(each))} (median of {len(each)}), {five.percent(min(each))} to {five.percent(max(each))}"
            for text, each in errors.items()
        ]


def _from_cycles(item: WorkItem, outcomes: Outcomes) -> Iterator[Record]:
    """Yield how far a look in Realtime is from each take of Cycles."""
    cycles = replace(item, engine=CYCLES.key).name
    realtime, pixels = array("f", outcomes.read(item.name, "0.f32")), array("i", outcomes.read(cycles, "i32"))
    for k, take in enumerate(outcomes.record(cycles)["takes"]):
        rgb = array("f", outcomes.read(cycles, f"{k}.f32"))
        reference = five.CyclesReference(take["osl"], take["quality"], take["samples"], pixels, rgb)
        difference = five.realtime_difference(realtime, reference)
        yield {"character": item.character, "frame": item.frame, "name": item.look, **difference}
