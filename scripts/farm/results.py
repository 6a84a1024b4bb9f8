# SPDX-License-Identifier: GPL-3.0-or-later
"""The results of a job's work items on disk: one archive for each, which is whole wherever it bears its final name. No bpy.

So two that render the same item do not get into each other's way, and whoever is killed leaves nothing that counts.
"""

import io
import json
import os
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from uuid import uuid4
from zipfile import ZipFile

from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.comparison.outcomes import Outcomes, WorkError

RECORD = "record.json"  # in an archive, beside the item's files, which are called by their suffixes


class Results(Outcomes):
    """The outcomes of a job's work items in `folder`. `job` identifies the job: results of another job do not count."""

    def __init__(self, folder: Path, job: str) -> None:
        self.folder = folder
        self.job = job
        self._records: dict[str, Record] = {}  # of the archives that have been read and found whole

    def keep(self, name: str, record: Record, files: Mapping[str, bytes]) -> None:
        """Keep what an item came to, its `files` by their suffixes. Raises WorkError where that cannot be written."""
        content = io.BytesIO()
        with ZipFile(content, "w") as archive:
            archive.writestr(RECORD, json.dumps({"job": self.job, "record": record, "files": list(files)}, allow_nan=False))
            for suffix, file in files.items():
                archive.writestr(suffix, file)
        target = self._path(name)
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            write_whole(target, content.getvalue())
        except OSError as error:
            raise WorkError(f"cannot write {target}: {error.strerror}") from error

    def has(self, name: str) -> bool:
        """Return whether an item is done and whole."""
        with suppress(WorkError):
            self.record(name)
            return True
        return False

    def record(self, name: str) -> Record:
        """Return the record of an item; raises WorkError where its archive is missing or damaged, all of which is read once."""
        if name not in self._records:
            try:
                with ZipFile(self._path(name)) as archive:
                    document = json.loads(archive.read(RECORD))
                    is_whole = archive.testzip() is None and archive.namelist() == [RECORD, *document["files"]]
            except FileNotFoundError:
                raise WorkError(f"{name} is missing") from None
            except OSError as error:
                raise WorkError(f"{name} cannot be read: {error.strerror}") from None
            except Exception as error:  # of many kinds, as damage may be anywhere
                raise WorkError(f"{name} is damaged") from error
            if not is_whole:
                raise WorkError(f"{name} is damaged")
            if document["job"] != self.job:
                raise WorkError(f"{name} is of another job")
            self._records[name] = document["record"]
        return self._records[name]

    def read(self, name: str, suffix: str) -> bytes:
        """Return what a file of an item holds; raises WorkError as `record` does."""
        self.record(name)
        with ZipFile(self._path(name)) as archive:
            return archive.read(suffix)

    def check(self, names: Iterable[str]) -> None:
        """Raise WorkError, with a line for each in its details, where some of these items are missing or damaged."""
        problems = []
        for name in names:
            try:
                self.record(name)
            except WorkError as error:
                problems.append(str(error))
        if problems:
            raise WorkError(f"{len(problems)} work items are missing or damaged", problems)

    def _path(self, name: str) -> Path:
        return self.folder / f"{name}.zip"


def write_whole(path: Path, content: bytes) -> None:
    """Write a file that is whole or not there, whoever else writes it. Raises OSError."""
    new = path.with_name(f".{path.name}.{uuid4().hex}.tmp")
    try:
        with new.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        new.replace(path)
    finally:
        new.unlink(missing_ok=True)
