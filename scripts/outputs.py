# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing results so that a file under its final name is always whole: all are made in a hidden folder and moved at the end."""

import shutil
import tempfile
from pathlib import Path
from types import TracebackType

from console import BadInput


class Staging:
    """A context with a hidden `folder` beside the final one; `publish` moves its files to `target`, leaving it removes the rest.

    Raises BadInput on entry where `target` cannot be a folder to write to.
    """

    def __init__(self, target: Path) -> None:
        self.target = target

    def __enter__(self) -> "Staging":
        place = self.target
        while not place.exists():
            place = place.parent
        if not place.is_dir():
            raise BadInput(f"output folder {self.target}: {place} is a file")
        try:
            self.folder = Path(tempfile.mkdtemp(prefix=".true_diffuse_", dir=place)).resolve()
        except OSError as error:
            raise BadInput(f"cannot write to output folder {self.target}: {error.strerror}") from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.discard()

    def discard(self) -> None:
        """Remove the hidden folder and all in it."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def publish(self) -> list[str]:
        """Move the files to the target folder, replacing older ones; returns their names."""
        self.target.mkdir(parents=True, exist_ok=True)
        names = sorted(path.name for path in self.folder.iterdir())
        for name in names:
            (self.folder / name).replace(self.target / name)
        return names
