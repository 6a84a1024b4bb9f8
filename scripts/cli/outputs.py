# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing results so that a file under its final name is always whole: all are made in a hidden folder and moved at the end."""

import errno
import json
import os
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from true_diffuse.scripts.cli.console import BadInput

FILES = "files"  # in the hidden folder


class OutputFolder:
    """A context with a `folder` hidden in the final one; `publish` moves its files to `target`, leaving it removes the rest.

    `target` is made where it is missing, and removed again where nothing gets published. While one writes to it, or to the one file
    `name` in it, no other does. Raises BadInput on entry where another does or `target` cannot be a folder to write to.

    `room` is the hidden folder where another process has entered it and will leave it.
    """

    def __init__(self, target: Path, name: str = "", room: Path | None = None) -> None:
        self.target = target
        self.made: list[Path] = []
        self.room = room
        self._prefix = f".true_diffuse_{name}"
        self._enters = room is None
        self._lock: int | None = None

    def __enter__(self) -> "OutputFolder":
        if self._enters:
            try:
                for place in reversed((self.target, *self.target.parents)):
                    if not place.exists():
                        place.mkdir(exist_ok=True)
                        self.made.append(place)
                self._lock = lock(self._lock_path)
                if self._lock is not None:
                    self._remove_rooms()
                self.room = Path(tempfile.mkdtemp(prefix=f"{self._prefix}.", dir=self.target)).resolve()
                self.folder.mkdir()
            except OSError as error:
                self.discard()
                raise BadInput(f"cannot write to output folder {self.target}: {error.strerror}") from error
            except BadInput:
                self.discard()
                raise
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        if self._enters:
            self.discard()

    @property
    def folder(self) -> Path:
        """Where files are written before they are published."""
        assert self.room is not None
        return self.room / FILES

    @property
    def _lock_path(self) -> Path:
        return self.target / f"{self._prefix}.lock"

    def _remove_rooms(self) -> None:
        """Remove the hidden folders of those who were killed."""
        for path in self.target.iterdir():
            _, prefix, unique = path.name.rpartition(f"{self._prefix}.")
            if prefix and path != self._lock_path and "." not in unique:  # a dot: of another name, which begins as this one
                shutil.rmtree(path, ignore_errors=True)

    def discard(self) -> None:
        """Remove the hidden folder with all in it, and the folders that were made for it as far as they are empty."""
        if self.room is not None:
            shutil.rmtree(self.room, ignore_errors=True)
        if self._lock is not None:
            with suppress(OSError):  # Windows removes no open file
                self._lock_path.unlink()
            os.close(self._lock)
            self._lock = None
        for place in reversed(self.made):
            with suppress(OSError):
                place.rmdir()

    def write_json(self, name: str, document: object) -> None:
        """Stage `document` as the file `name`. Raises ValueError for a NaN, which JSON cannot hold."""
        self.write_text(name, json.dumps(document, indent=2, allow_nan=False) + "\n")

    def write_text(self, name: str, text: str) -> None:
        """Stage `text` as the file `name`."""
        (self.folder / name).write_text(text, encoding="utf-8")

    def others(self) -> list[Path]:
        """Return what is in the target folder beside what this is for."""
        return [path for path in self.target.iterdir() if not path.name.startswith(f"{self._prefix}.")]

    def publish(self) -> list[str]:
        """Move the files to the target folder, replacing older ones; returns their paths. Raises BadInput where that fails."""
        names = sorted(path.relative_to(self.folder).as_posix() for path in self.folder.rglob("*") if path.is_file())
        for name in names:
            if (self.target / name).is_dir():
                raise BadInput(f"{self.target / name} is a folder")
        for name in names:
            try:
                (self.target / name).parent.mkdir(parents=True, exist_ok=True)
                (self.folder / name).replace(self.target / name)
            except OSError as error:
                raise BadInput(f"cannot write {self.target / name}: {error.strerror}") from error
        return names


def lock(path: Path) -> int | None:
    """Return the descriptor of a new file that no other process can lock until this closes it or ends, however it ends.

    None where the file system has no locks. Raises BadInput where another process has it, OSError where it cannot be made.
    """
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
        try:
            if not _locked(descriptor):
                os.close(descriptor)
                return None
        except OSError as error:
            os.close(descriptor)
            if error.errno in (errno.EACCES, errno.EAGAIN, errno.EDEADLK):
                raise BadInput(
                    f"{path.parent} is being written by another run: wait for its end, or choose another --out"
                ) from None
            raise
        with suppress(FileNotFoundError):
            if os.path.samestat(os.fstat(descriptor), path.stat()):
                return descriptor
        os.close(descriptor)  # the other has ended and removed it meanwhile


def _locked(descriptor: int) -> bool:
    """Lock a file; return False where the file system cannot. Raises OSError where another process has locked it."""
    if os.name == "nt":
        import msvcrt

        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        return True
    import fcntl

    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        if error.errno in (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP):
            return False
        raise
    return True
