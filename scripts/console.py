# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scripts show in a terminal: progress, tables, one-line errors; Blender's own chatter goes to a file instead.

Rich draws it where it is installed; Blender's own Python lacks it, and then plain lines do.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import IO, NoReturn

try:
    import rich.console
    import rich.progress
    import rich.table
except ImportError:
    rich = None

WIDTH = 100  # of output that goes to a file
BAD_INPUT = 2  # exit status for anything the user can mend


class BadInput(Exception):
    """The user asked for something that cannot be done; the message is one line."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line on stderr and exit status 2."""

    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: error: {' '.join(message.split())}", file=sys.stderr)
        sys.exit(BAD_INPUT)


def script_arguments() -> list[str]:
    """Return the script's own arguments: under `blender --python SCRIPT -- ARGUMENTS` those after the two dashes."""
    if sys.argv and os.path.basename(sys.argv[0]).endswith(".py"):
        return sys.argv[1:]
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


class Terminal:
    """A context in which only what goes through this object reaches the terminal; the rest goes to a log kept for errors."""

    def __enter__(self) -> "Terminal":
        sys.stdout.flush()
        sys.stderr.flush()
        self._log = tempfile.TemporaryFile()
        self._saved = [os.dup(1), os.dup(2)]
        self.out: IO[str] = os.fdopen(os.dup(1), "w", buffering=1)
        for descriptor in (1, 2):
            os.dup2(self._log.fileno(), descriptor)
        self._rich = rich.console.Console(file=self.out, width=None if os.isatty(self._saved[0]) else WIDTH) if rich else None
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        for descriptor, saved in zip((1, 2), self._saved, strict=True):
            os.dup2(saved, descriptor)
            os.close(saved)
        self.out.close()
        if kind is not None and issubclass(kind, Exception) and kind is not BadInput:
            self._log.seek(0)
            tail = self._log.read().decode(errors="replace").splitlines()[-40:]
            print("Blender's last words:", *tail, sep="\n", file=sys.stderr)
        self._log.close()

    def say(self, text: str) -> None:
        """Print one line."""
        if self._rich:
            self._rich.print(text, markup=False, highlight=False, soft_wrap=True)
        else:
            print(text, file=self.out)

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Print rows of text under `columns`: the first two are words, the others figures."""
        if self._rich:
            table = rich.table.Table(title=title)
            for index, column in enumerate(columns):
                table.add_column(column, justify="left" if index < 2 else "right")
            for row in rows:
                table.add_row(*row)
            self._rich.print(table)
            return
        widths = [max(len(row[i]) for row in (columns, *rows)) for i in range(len(columns))]
        print(title, file=self.out)
        for row in (columns, *rows):
            print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)), file=self.out)

    @contextmanager
    def progress(self, total: float) -> Iterator["Progress"]:
        """Yield a `Progress` that counts up to `total` units of work."""
        if not self._rich:
            yield Progress(self, total, None)
            return
        bar = rich.progress.Progress(
            rich.progress.TextColumn("{task.description}"),
            rich.progress.BarColumn(),
            rich.progress.TaskProgressColumn(),
            rich.progress.TimeElapsedColumn(),
            rich.progress.TimeRemainingColumn(elapsed_when_finished=True),
            console=self._rich,
        )
        with bar:
            yield Progress(self, total, bar)


class Progress:
    """Work done so far, in units of the caller's choice."""

    def __init__(self, terminal: Terminal, total: float, bar: "rich.progress.Progress | None") -> None:
        self._terminal = terminal
        self._total = total
        self._done = 0.0
        self._bar = bar
        self._task = bar.add_task("", total=total) if bar else None

    @contextmanager
    def step(self, text: str, work: float) -> Iterator[None]:
        """Show `text` while the body runs; count `work` units as done after it."""
        if self._bar:
            self._bar.update(self._task, description=text)
            self._bar.refresh()
        else:
            self._terminal.say(f"{100.0 * self._done / self._total:3.0f} %  {text}")
        yield
        self._done += work
        self.within(0.0)

    def within(self, work: float) -> None:
        """Show `work` units of the step under way as done."""
        if self._bar:
            self._bar.update(self._task, completed=self._done + work)
            self._bar.refresh()
