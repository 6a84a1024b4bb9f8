# SPDX-License-Identifier: GPL-3.0-or-later
"""What has been measured so far, on disk, so that a study that was ended goes on from there. No bpy."""

import hashlib
import json
import shutil
from array import array
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from true_diffuse.addon.measure.record import Record

UNITS, PICTURE = "units.jsonl", "{}.f32"
ROOT = Path(__file__).resolve().parents[3]
SOURCES = (
    *(f"addon/{room}" for room in ("models", "closures", "blender", "nodes", "material", "measure", "realtime", "probe")),
    *("scenes", "scripts/characters", "scripts/studies", "shaders"),
)

type Key = tuple[str | int, ...]


def sources() -> str:
    """Return a digest of the code that the figures come from: another version of it may give others."""
    digest = hashlib.sha256()
    for folder in SOURCES:
        for path in sorted((ROOT / folder).rglob("*")):
            if path.suffix in {".py", ".glsl", ".osl"}:
                digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
    return digest.hexdigest()


class Notes:
    """Finished units of work and the pictures that were kept, in memory."""

    def __init__(self) -> None:
        self.units: dict[Key, Record] = {}
        self.pictures: dict[str, array[float]] = {}

    def add(self, key: Key, record: Record) -> None:
        """Keep a finished unit."""
        self.units[key] = record

    def keep_picture(self, name: str, rgb: array[float]) -> None:
        """Keep a picture, before its unit is."""
        self.pictures[name] = rgb

    def picture(self, name: str) -> array[float]:
        """Return a picture that was kept."""
        return self.pictures[name]

    def of(self, kind: str) -> Iterator[Record]:
        """Yield the records whose key begins with `kind`."""
        return (record for key, record in self.units.items() if key[0] == kind)


class Journal(Notes):
    """A folder of finished units of work. `is_begun`: it held some; `is_foreign`: it held another study's, which are gone.

    `identity` says what the figures depend on. Each unit is a line of JSON with its key, so a line that was cut off is a unit that
    was not finished. Raises OSError where the folder cannot be written.
    """

    def __init__(self, folder: Path, identity: Record) -> None:
        super().__init__()
        self.folder = folder
        path = self.folder / UNITS
        header, *lines = _lines(path) if path.is_file() else [{}]
        same = header.get("identity") == json.loads(json.dumps(identity))
        self.is_foreign = not same and path.is_file()
        if same:
            self.units = {tuple(line["key"]): line["record"] for line in lines}
        self.is_begun = bool(self.units)
        if self.is_foreign:
            self.remove()
        self.folder.mkdir(parents=True, exist_ok=True)
        if same:  # without what may have been cut off
            self._rewrite([header, *lines])
        else:
            self._rewrite([{"identity": identity}])
        self._file = path.open("a", encoding="utf-8")

    def _rewrite(self, lines: list[Record]) -> None:
        whole = self.folder / f"{UNITS}.new"
        whole.write_text("".join(json.dumps(line) + "\n" for line in lines), encoding="utf-8")
        whole.replace(self.folder / UNITS)

    def add(self, key: Key, record: Record) -> None:
        self._file.write(json.dumps({"key": key, "record": record}) + "\n")
        self._file.flush()
        super().add(key, record)

    def keep_picture(self, name: str, rgb: array[float]) -> None:
        whole = self.folder / f"{PICTURE.format(name)}.new"
        whole.write_bytes(rgb.tobytes())
        whole.replace(self.folder / PICTURE.format(name))

    def picture(self, name: str) -> array[float]:
        rgb = array("f")
        rgb.frombytes((self.folder / PICTURE.format(name)).read_bytes())
        return rgb

    def remove(self) -> None:
        """Remove it: the study is done, or another's."""
        with suppress(AttributeError):
            self._file.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def _lines(path: Path) -> list[Record]:
    """Return the lines up to the first that is damaged; [{}] where all are."""
    found = []
    for line in path.read_bytes().splitlines():
        try:
            record = json.loads(line)
        except ValueError:
            break
        if not isinstance(record, dict) or (found and not {"key", "record"} <= record.keys()):
            break
        found.append(record)
    return found or [{}]
