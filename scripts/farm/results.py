# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of a job's work items on disk: a record each, with files, so that what bears a final name is whole. No bpy.

An item's files are written first, under names with their digest, and its record, which has these names, last; all under another
name at first. So two that render the same item do not get into each other's way, and whoever is killed leaves nothing that counts.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.comparison.outcomes import Outcomes, WorkError

TEMPORARY = ".tmp"


class Incomplete(WorkError):
    """Work items are missing or damaged: `problems` has a line for each."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__(f"{len(problems)} work items are missing or damaged")
        self.problems = problems


class Results(Outcomes):
    """The outcomes of a job's work items in `folder`. `job` identifies the job: results of another job do not count."""

    def __init__(self, folder: Path, job: str) -> None:
        super().__init__()
        self.folder = folder
        self.job = job
        self._whole: dict[str, tuple[Record, Mapping[str, Path]]] = {}  # what has been read and found whole

    def keep(self, name: str, record: Record, files: Mapping[str, bytes]) -> None:
        """Keep what an item came to, its `files` by their suffixes. Raises WorkError where that cannot be written."""
        target = self.folder / f"{name}.json"
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            kept = {}
            for suffix, content in files.items():
                digest = hashlib.sha256(content).hexdigest()
                kept[suffix] = {"name": f"{target.stem}-{digest[:12]}.{suffix}", "sha256": digest}
                write_whole(target.parent / kept[suffix]["name"], content)
            text = json.dumps({"job": self.job, "record": record, "files": kept, "sha256": _digest(record)}, allow_nan=False)
            write_whole(target, text.encode())
        except OSError as error:
            raise WorkError(f"cannot write {target}: {error.strerror}") from error

    def has(self, name: str) -> bool:
        """Return whether an item is done and whole."""
        with suppress(WorkError):
            self._read(name)
            return True
        return False

    def record(self, name: str) -> Record:
        """Return the record of an item; raises WorkError where it is missing or damaged, or one of its files is."""
        return self._read(name)[0]

    def read(self, name: str, suffix: str) -> bytes:
        """Return what a file of an item holds; raises WorkError as `record` does."""
        return self._read(name)[1][suffix].read_bytes()

    def copy(self, name: str, suffix: str, target: Path) -> None:
        """Make `target` the same file as one of an item, or a copy where the disk cannot have one file twice."""
        source = self._read(name)[1][suffix]
        try:
            os.link(source, target)
        except OSError:
            shutil.copyfile(source, target)

    def check(self, names: Iterable[str]) -> None:
        """Raise Incomplete where one of these items is missing or damaged, or a file of it is."""
        problems = []
        for name in names:
            try:
                self._read(name)
            except WorkError as error:
                problems.append(str(error))
        if problems:
            raise Incomplete(problems)

    def _read(self, name: str) -> tuple[Record, Mapping[str, Path]]:
        """Return the record and the files of an item, having read all of them once."""
        if name not in self._whole:
            path = self.folder / f"{name}.json"
            try:
                document = json.loads(path.read_bytes())
                record, listed, digest = document["record"], document["files"], document["sha256"]
            except FileNotFoundError:
                raise WorkError(f"{name} is missing") from None
            except OSError as error:
                raise WorkError(f"{name} cannot be read: {error.strerror}") from None
            except (ValueError, TypeError, KeyError):
                raise WorkError(f"{name} is damaged") from None
            if digest != _digest(record):
                raise WorkError(f"{name} is damaged")
            if document["job"] != self.job:
                raise WorkError(f"{name} is of another job")
            files = {suffix: path.with_name(file["name"]) for suffix, file in listed.items()}
            for suffix, file in files.items():
                _check(name, file, listed[suffix]["sha256"])
            self._whole[name] = record, files
        return self._whole[name]


def _check(name: str, path: Path, sha256: str) -> None:
    """Raise WorkError where a file of an item cannot be read or has another digest."""
    try:
        with path.open("rb") as opened:
            digest = hashlib.file_digest(opened, "sha256").hexdigest()
    except OSError as error:
        raise WorkError(f"{name}: {path.name} cannot be read: {error.strerror}") from None
    if digest != sha256:
        raise WorkError(f"{name}: {path.name} is damaged")


def write_whole(path: Path, content: bytes) -> None:
    """Write a file that is whole or not there, whoever else writes it. Raises OSError."""
    new = path.with_name(f".{path.name}.{uuid4().hex}{TEMPORARY}")
    try:
        with new.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)


def _digest(record: Record) -> str:
    return hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest()
