# SPDX-License-Identifier: GPL-3.0-or-later
"""The face: its heads with BRDF, BSSRDF and the mixed model, region by region in the other engines against Cycles."""

from array import array
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import bpy

from true_diffuse.addon.blender.engines import CYCLES, ENGINES, Engine
from true_diffuse.addon.measure.record import Progress
from true_diffuse.scripts.characters import character as characters
from true_diffuse.scripts.characters import face as scene
from true_diffuse.scripts.studies import face, pictures
from true_diffuse.scripts.studies.comparison import base
from true_diffuse.scripts.studies.comparison.base import PICTURE, PICTURE_SUFFIXES, Frame, WorkItem
from true_diffuse.scripts.studies.comparison.outcomes import Outcomes, Rendered
from true_diffuse.scripts.studies.five import MEASUREMENT_WORK

LOOKS = {look.name: look for look in scene.LOOKS}


@dataclass(frozen=True, kw_only=True)
class JobSpec(base.JobSpec):
    """As the base has it."""

    @property
    def measured(self) -> tuple[str, ...]:
        return tuple(LOOKS)

    def work(self, item: WorkItem) -> float:
        if item.look == PICTURE:
            return pictures.PICTURE_WORK
        # what the camera sees is worked out for the first engine alone
        return (face.REPEATS[ENGINES[item.engine]] + (item.engine == self.engines[0])) * MEASUREMENT_WORK


class Renderer(base.Renderer[JobSpec]):
    """As the base has it."""

    denoised = (CYCLES,)
    _face: scene.Face
    _seen: dict[str, face.VisibleRegions]

    def build(self, character: str, frames: Sequence[Frame]) -> bpy.types.Scene:
        who = self.spec.characters[character]
        self._face = scene.build(characters.load(who, self.notes.append), who == "human", self.spec.resolution)
        self._seen = {}
        return self._face.scene

    def captions(self) -> pictures.Captions:
        return face.captions(self._face)

    def measure(self, item: WorkItem, engine: Engine, progress: Progress) -> Rendered:
        only = replace(self._face, heads=tuple(head for head in self._face.heads if head.look.name == item.look))
        if item.look not in self._seen:
            (self._seen[item.look],) = face.visible_regions(only, progress)
        samples = self.spec.samples[engine.key]
        (measured,) = face.measure(only, engine, samples, progress)
        files = {f"{take}.f32": rgb.tobytes() for take, rgb in enumerate(measured.repeats)}
        return {"samples": samples, "seconds": measured.seconds, "regions": self._seen[item.look].pixels}, files

    def collect(self, items: Sequence[WorkItem], outcomes: Outcomes, folder: Path, collected: base.Collected) -> None:
        seen: dict[str, face.VisibleRegions] = {}
        measured = []
        for item in items:
            record, engine = outcomes.record(item.name), ENGINES[item.engine]
            collected.environments.append(record["environment"])
            if item.look == PICTURE:
                collected.pictures.append(record["picture"])
                collected.note(item.character, record["notes"])
                for suffix in PICTURE_SUFFIXES:
                    picture = folder / f"{self.spec.prefix(item)}face_{engine.key}.{suffix}"
                    picture.write_bytes(outcomes.read(item.name, suffix))
                continue
            look = LOOKS[item.look]
            seen[item.look] = face.VisibleRegions(look, record["regions"])
            takes = tuple(array("f", outcomes.read(item.name, f"{take}.f32")) for take in range(face.REPEATS[engine]))
            measured.append(face.Measurement(look, engine, record["samples"], record["seconds"], takes))
        found = face.records(list(seen.values()), measured)
        collected.records += [{"character": items[0].character, **record} for record in found]

    def summary(self, collected: base.Collected) -> list[str]:
        """Return a line for each head's front: how far the other engines are from Cycles."""
        return [
            f"{one['character']}, {one['look']}: {ENGINES[key].label} {100.0 * share:.2f} % from Cycles, front-lit"
            for one in collected.records
            if one["region"] == face.FRONT_LIT
            for key, share in one["rms_difference"].items()
            if share is not None
        ]
