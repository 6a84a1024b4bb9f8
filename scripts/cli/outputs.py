# SPDX-License-Identifier: GPL-3.0-or-later
"""Writing results so that a file under its final name is always whole: all are made in a hidden folder and moved at the end."""

import json
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from true_diffuse.scripts.cli.console import BadInput


class OutputFolder:
    """A context with a hidden `folder` inside the final one; `publish` moves its files to `target`, leaving it removes the rest.

    `target` is made where it is missing, and removed again where nothing gets published. Raises BadInput on entry where `target`
    cannot be a folder to write to.
    """

    def __init__(self, target: Path) -> None:
        self.target = target
        self.made: list[Path] = []

    def __enter__(self) -> "OutputFolder":
        try:
            for place in reversed((self.target, *self.target.parents)):
                if not place.exists():
                    place.mkdir()
                    self.made.append(place)
            self.folder = Path(tempfile.mkdtemp(prefix=".true_diffuse_", dir=self.target)).resolve()
        except OSError as error:
            self.discard()
            raise BadInput(f"cannot write to output folder {self.target}: {error.strerror}") from error
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.discard()

    def discard(self) -> None:
        """Remove the hidden folder with all in it, and the folders that were made for it as far as they are empty."""
        if hasattr(self, "folder"):
            shutil.rmtree(self.folder, ignore_errors=True)
        for place in reversed(self.made):
            with suppress(OSError):
                place.rmdir()

    def write_json(self, name: str, document: object) -> None:
        """Stage `document` as the file `name`. Raises ValueError for a NaN, which JSON cannot hold."""
        self.write_text(name, json.dumps(document, indent=2, allow_nan=False) + "\n")

    def write_text(self, name: str, text: str) -> None:
        """Stage `text` as the file `name`."""
        (self.folder / name).write_text(text, encoding="utf-8")

    def publish(self) -> list[str]:
        """Move the files to the target folder, replacing older ones; returns their names. Raises BadInput where that fails."""
        names = sorted(path.name for path in self.folder.iterdir())
        for name in names:
            if (self.target / name).is_dir():
                raise BadInput(f"{self.target / name} is a folder")
        for name in names:
            try:
                (self.folder / name).replace(self.target / name)
            except OSError as error:
                raise BadInput(f"cannot write {self.target / name}: {error.strerror}") from error
        return names
