# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of a batch's parts on disk: a record each, with files, so that what bears a final name is whole. No bpy.

A part's files are written first, under names with their digest, and its record, which has these names, last; all under another
name at first. So two that do the same part do not get into each other's way, and whoever is killed leaves nothing that counts.
"""

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from uuid import uuid4

from true_diffuse.addon.measure.record import Record

TEMPORARY = ".tmp"


class BatchError(Exception):
    """A part cannot be done or used; the message is one line for the user."""


class Incomplete(BatchError):
    """Parts are missing or damaged: `problems` has a line for each."""

    def __init__(self, problems: list[str]) -> None:
        super().__init__(f"{len(problems)} parts are missing or damaged")
        self.problems = problems


class Results:
    """The results in `folder`. `job` names what they are of: results of another are no results."""

    def __init__(self, folder: Path, job: str) -> None:
        self.folder = folder
        self.job = job

    def keep(self, name: str, record: Record, files: Mapping[str, bytes]) -> None:
        """Keep what a part came to, its `files` by their suffixes. Raises BatchError where that cannot be written."""
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
            raise BatchError(f"cannot write {target}: {error.strerror}") from error

    def record(self, name: str) -> Record:
        """Return the record of a part; raises BatchError where it is missing or damaged, or one of its files is."""
        record, files = self._read(name)
        for file in files.values():
            path = (self.folder / name).with_name(file["name"])
            try:
                with path.open("rb") as opened:
                    digest = hashlib.file_digest(opened, "sha256").hexdigest()
            except OSError as error:
                raise BatchError(f"{name}: {path.name} cannot be read: {error.strerror}") from None
            if digest != file["sha256"]:
                raise BatchError(f"{name}: {path.name} is damaged")
        return record

    def file(self, name: str, suffix: str) -> Path:
        """Return the path of a file of a part whose record is whole; raises BatchError where there is no record."""
        _, files = self._read(name)
        return (self.folder / name).with_name(files[suffix]["name"])

    def has(self, name: str) -> bool:
        """Return whether a part is done and whole."""
        with suppress(BatchError):
            self.record(name)
            return True
        return False

    def records(self, names: Iterable[str]) -> list[Record]:
        """Return the records of these parts; raises Incomplete where one is missing or damaged, or a file of it is."""
        found, problems = [], []
        for name in names:
            try:
                found.append(self.record(name))
            except BatchError as error:
                problems.append(str(error))
        if problems:
            raise Incomplete(problems)
        return found

    def _read(self, name: str) -> tuple[Record, Mapping[str, Record]]:
        path = self.folder / f"{name}.json"
        try:
            document = json.loads(path.read_bytes())
            record, files, digest = document["record"], document["files"], document["sha256"]
        except FileNotFoundError:
            raise BatchError(f"{name} is missing") from None
        except OSError as error:
            raise BatchError(f"{name} cannot be read: {error.strerror}") from None
        except (ValueError, TypeError, KeyError):
            raise BatchError(f"{name} is damaged") from None
        if digest != _digest(record):
            raise BatchError(f"{name} is damaged")
        if document["job"] != self.job:
            raise BatchError(f"{name} is of another job")
        return record, files


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
