# SPDX-License-Identifier: GPL-3.0-or-later
"""Job specs, the work items they consist of, the renderer of these, and the collected results.

A work item is the least that is rendered and kept by itself: the picture of a scene in an engine, or the measurement of one look.
"""

import tempfile
from abc import ABC, abstractmethod
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

import bpy

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.engines import ENGINES, Engine
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.probe.environment import environment
from true_diffuse.scripts.characters.character import CharacterError
from true_diffuse.scripts.studies import pictures
from true_diffuse.scripts.studies.comparison.outcomes import Outcomes, Rendered, Spec, WorkError, merged

PICTURE, ERROR_MAP = "picture", "error_map"  # beside the looks' names
PICTURE_SUFFIXES = ("png", "exr")
CHUNK = 8

type Frame = int | None  # None is the frame that a file was saved at


@dataclass(frozen=True)
class WorkItem:
    """A picture, an error map, or the measurement of one look, of a character in an engine."""

    character: str
    frame: Frame
    engine: str
    look: str

    @property
    def name(self) -> str:
        """What its results are called."""
        frame = "still" if self.frame is None else f"{self.frame:04d}"
        return f"{self.character}/{frame}/{self.engine}_{self.look}"


@dataclass(frozen=True, kw_only=True)
class JobSpec(Spec, ABC):
    """What is asked for. `characters` are by name what `character.load` takes; `samples` by an engine's key."""

    characters: Mapping[str, str]
    frames: tuple[Frame, ...] = (None,)
    engines: tuple[str, ...]
    samples: Mapping[str, int]
    resolution: tuple[int, int]
    chunk: int = CHUNK
    """How many frames' meshes whoever renders keeps at a time."""

    maps: ClassVar[tuple[str, ...]] = ()
    """Pictures that are drawn of the looks' measurements, by name."""

    @property
    @abstractmethod
    def measured(self) -> tuple[str, ...]:
        """The names of the looks that are measured."""

    @property
    def rendered(self) -> tuple[str, ...]:
        """The picture of all, and the looks that are measured."""
        return (PICTURE, *self.measured)

    def chunks(self) -> Iterator[list[WorkItem]]:
        """Yield all work items, those together that need the same meshes, one engine's after another's."""
        for character in self.characters:
            for first in range(0, len(self.frames), self.chunk):
                frames = self.frames[first : first + self.chunk]
                looks = (*self.rendered, *self.maps)
                yield [WorkItem(character, frame, engine, look) for engine in self.engines for frame in frames for look in looks]

    def prefix(self, item: WorkItem) -> str:
        """Return what the names of an item's pictures begin with, as far as there are others."""
        character = f"{item.character}_" if len(self.characters) > 1 else ""
        return character if item.frame is None else f"{character}{item.frame:04d}_"

    @abstractmethod
    def work(self, item: WorkItem) -> float:
        """Return the work that a `Renderer` reports of an item to a `Progress` when all are rendered in turn."""


@dataclass
class Collected:
    """The merged results of work items: a record for each look, how pictures were rendered, and the environments."""

    records: list[Record] = field(default_factory=list)
    pictures: list[Record] = field(default_factory=list)
    realtime_from_cycles: list[Record] = field(default_factory=list)
    """How far the two are from each other, for each look, where both are."""
    environments: list[Record] = field(default_factory=list)
    notes: list[Record] = field(default_factory=list)
    """What is not shown of a character, in a line each."""

    def note(self, character: str, lines: Sequence[str]) -> None:
        """Keep lines about a character, each once."""
        self.notes += [note for line in lines if (note := {"character": character, "text": line}) not in self.notes]

    def document(self) -> Record:
        """Return what compare.json holds beside the options; all environments where machines differ."""
        first, differing = merged(self.environments)
        others = {"environments": differing, "pictures": self.pictures, "realtime_from_cycles": self.realtime_from_cycles}
        others["notes"] = self.notes
        return {"records": self.records, "environment": first} | {name: each for name, each in others.items() if each}


class Renderer[Asked: JobSpec](ABC):
    """Renders the work items of a `spec` with the engines that run here, and keeps the scene of the last character."""

    denoised: ClassVar[tuple[Engine, ...]] = ()  # engines whose pictures are
    scene: bpy.types.Scene | None = None

    def __init__(self, spec: Asked, usable: Sequence[Engine]) -> None:
        self.spec = spec
        self.usable = usable
        self.engine: Engine | None = None
        self.notes: list[str] = []  # on the character
        self._character: str | None = None
        self._outfit = ""
        self._frames: Sequence[Frame] = ()

    def do(self, items: Sequence[WorkItem], outcomes: Outcomes, progress: Progress) -> None:
        """Render those of the `items`, of one character, that are not done yet, and keep what they come to.

        Raises WorkError where the character cannot be had, a render fails, or the engine does not run here.
        """
        frames = list(dict.fromkeys(item.frame for item in items))
        for item in items:
            if not outcomes.has(item.name):
                with one_line(item.name):
                    outcomes.keep(item.name, *self.render(item, frames, outcomes, progress))

    def render(self, item: WorkItem, frames: Sequence[Frame], outcomes: Outcomes, progress: Progress) -> Rendered:
        """Return the record and files of an item; `frames` are those whose meshes to keep in memory."""
        engine = ENGINES[item.engine]
        if item.look in self.spec.maps:
            return self.draw_map(item, outcomes, progress)
        if engine not in self.usable:
            raise RuntimeError(f"{engine.label} does not run on this machine")
        self._prepare(item, frames, engine)
        record, files = self._picture(item, engine, progress) if item.look == PICTURE else self.measure(item, engine, progress)
        return {"environment": environment([engine]), **record}, files

    def _prepare(self, item: WorkItem, frames: Sequence[Frame], engine: Engine) -> None:
        """Have the scene show the frame of an item, ready for an engine."""
        if self.scene is None or item.character != self._character or item.frame not in self._frames:
            self.scene = self._character = self.engine = None
            bpy.ops.wm.read_factory_settings(use_empty=True)
            self._frames = frames
            self.notes = []
            self.scene = self.build(item.character, frames)
            self._character = item.character
        self.show(item.frame)
        outfit = self.outfit(item.look)
        if engine is not self.engine or outfit != self._outfit:
            self.wear(outfit)
            self._outfit = outfit
            self.configure(engine)
            engines.use(self.scene, engine, self.spec.samples[engine.key])
            self.engine = engine

    def _picture(self, item: WorkItem, engine: Engine, progress: Progress) -> Rendered:
        assert self.scene is not None
        samples, denoised = self.spec.samples[engine.key], engine in self.denoised
        with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
            target = Path(folder) / "picture"
            seconds = pictures.render_picture(self.scene, engine, samples, target, self.captions(), progress, denoised)
            files = {suffix: target.with_name(f"picture_{engine.key}.{suffix}").read_bytes() for suffix in PICTURE_SUFFIXES}
        about = {"character": item.character, "engine": engine.key, "samples": samples, "denoised": denoised}
        return {"picture": {**about, "render_seconds": seconds}, "notes": self.notes}, files

    def show(self, frame: Frame) -> None:  # noqa: B027 - a comparison may have nothing to do here
        """Have the scene show a frame."""

    def finish(self) -> None:
        """Leave the last scene as its picture shows it, for people to open."""
        if self.scene:
            self.wear(self.outfit(PICTURE))

    def outfit(self, look: str) -> str:
        """Return the name of what the characters wear for a look, or for the picture; empty where it is the same for all."""
        return ""

    def wear(self, outfit: str) -> None:  # noqa: B027
        """Have the characters wear an outfit."""

    def configure(self, engine: Engine) -> None:  # noqa: B027
        """Set what was picked for an engine beside its samples."""

    def draw_map(self, item: WorkItem, outcomes: Outcomes, progress: Progress) -> Rendered:
        """Return the picture that is drawn of measurements."""
        raise NotImplementedError

    @abstractmethod
    def build(self, character: str, frames: Sequence[Frame]) -> bpy.types.Scene:
        """Build and return the scene of a character, ready to show `frames`."""

    @abstractmethod
    def captions(self) -> pictures.Captions:
        """Return the captions of the picture."""

    @abstractmethod
    def measure(self, item: WorkItem, engine: Engine, progress: Progress) -> Rendered:
        """Return the measurement of a look."""

    @abstractmethod
    def collect(self, items: Sequence[WorkItem], outcomes: Outcomes, folder: Path, collected: Collected) -> None:
        """Write the pictures of a chunk's items into `folder`, and add the rest to `collected`."""

    @abstractmethod
    def summary(self, collected: Collected) -> list[str]:
        """Return lines that sum up what was collected, for people."""


@contextmanager
def one_line(name: str) -> Generator[None]:
    """Raise WorkError, which names the work item, for what can go wrong while it is rendered."""
    try:
        yield
    except (CharacterError, OSError, RuntimeError) as error:
        raise WorkError(f"{name}: {' '.join(str(error).split())}") from error
