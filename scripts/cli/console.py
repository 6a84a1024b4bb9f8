# SPDX-License-Identifier: GPL-3.0-or-later
"""What the scripts show in a terminal: progress, tables, one-line errors; Blender's own output goes to a log instead.

Progress is a bar in a terminal where the package rich is installed, which it is not in Blender's own Python; lines elsewhere.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NoReturn, Self

try:
    from rich import progress as bars
    from rich.console import Console
except ImportError:
    bars = None

from true_diffuse.scripts.studies.comparison.outcomes import WorkError
from true_diffuse.scripts.web import WebError

if TYPE_CHECKING:
    from _typeshed import SupportsWrite

BAD_INPUT = 2  # exit status for anything the user can fix
CLOSED_PIPE = 128 + 13  # exit status of programs that SIGPIPE ends
LOG_LINES = 40  # of Blender's output that are shown after a crash of the script

type Show = Callable[[float, str], None]  # is told how far long work is [%], and with what


class BadInput(Exception):
    """The user asked for something that cannot be done; the message is one line."""


class Parser(argparse.ArgumentParser):
    """An argument parser whose errors are one line on stderr and exit status 2."""

    def error(self, message: str) -> NoReturn:
        print(f"{self.prog}: error: {' '.join(message.split())}", file=sys.stderr)
        sys.exit(BAD_INPUT)

    def print_help(self, file: "SupportsWrite[str] | None" = None) -> None:
        end(0, self.format_help())


def end(status: int, last: str = "") -> NoReturn:
    """End the process with an exit status and a last text. Blender does not write what Python still holds for stdout."""
    try:
        if last:
            sys.stdout.write(last)
        sys.stdout.flush()
    except OSError as error:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # Python flushes it once more
        if not isinstance(error, BrokenPipeError):
            sys.exit(say_error(Path(sys.argv[0]).name, f"cannot write to standard output: {error.strerror}"))
        sys.exit(CLOSED_PIPE)
    sys.exit(status)


def script_arguments() -> list[str]:
    """Return the script's own arguments: under `blender --python SCRIPT -- ARGUMENTS` those after the two dashes."""
    if sys.argv[0].endswith(".py"):
        return sys.argv[1:]
    return sys.argv[sys.argv.index("--") + 1 :] if "--" in sys.argv else []


def one_line(text: str) -> str:
    """Return a text in one line, whatever names of files are in it."""
    return "".join(each if each.isprintable() else each.encode("unicode_escape").decode() for each in text)


def say_error(prog: str, message: str) -> int:
    """Say in one line what is wrong that the user can fix; return the exit status."""
    print(f"{prog}: error: {one_line(message)}", file=sys.stderr)
    return BAD_INPUT


def say_stopped(prog: str, left: str, number: int) -> int:
    """Say that a signal of this number has stopped the work and what is `left` of it; return the exit status."""
    print(f"\n{prog}: stopped, {left}", file=sys.stderr)
    return 128 + number


def show_cursor() -> None:
    """Show the terminal's cursor, which a bar hides that could not end."""
    if sys.stderr.isatty():
        print("\033[?25h", end="", file=sys.stderr, flush=True)


class Terminal:
    """A context in which only what goes through this object reaches the terminal; the rest goes to a log kept for errors."""

    def __init__(self) -> None:
        self.out = sys.stdout

    def __enter__(self) -> Self:
        sys.stdout.flush()
        sys.stderr.flush()
        self._log = tempfile.TemporaryFile()
        self._saved = [os.dup(1), os.dup(2)]
        self.out = os.fdopen(os.dup(1), "w", buffering=1, encoding=sys.stdout.encoding, errors="replace")
        for descriptor in (1, 2):
            os.dup2(self._log.fileno(), descriptor)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        for descriptor, saved in zip((1, 2), self._saved, strict=True):
            os.dup2(saved, descriptor)
            os.close(saved)
        with suppress(OSError):  # it was said, or nobody reads it
            self.out.close()
        if isinstance(error, Exception) and not isinstance(error, (BadInput, OSError, WebError, WorkError)):
            self._log.seek(0)
            print("Blender's last words:", *self._log.read().decode(errors="replace").splitlines()[-LOG_LINES:], sep="\n")
        self._log.close()

    def say(self, text: str) -> None:
        """Print one line. Ends the process where nobody reads on, as of head; raises BadInput where it cannot be written."""
        try:
            print(text, file=self.out)
        except BrokenPipeError:
            sys.exit(CLOSED_PIPE)
        except OSError as error:
            raise BadInput(f"cannot write to standard output: {error.strerror}") from error

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        """Print rows of text under `columns`: the first two are words, the others figures."""
        widths = [max(len(row[i]) for row in (columns, *rows)) for i in range(len(columns))]
        self.say(f"\n{title}")
        for row in (columns, *rows):
            cells = (text.ljust(w) if i < 2 else text.rjust(w) for i, (text, w) in enumerate(zip(row, widths, strict=True)))
            self.say("  ".join(cells))

    @contextmanager
    def progress(self, total: float) -> Generator["Progress"]:
        """Yield a `Progress` that counts up to `total` units of work: a bar of rich's, or without one a line for each step."""
        if bars is None or not self.out.isatty():
            said = ""

            def say(percent: float, text: str) -> None:
                nonlocal said
                if text != said:
                    self.say(f"{percent:3.0f} %  {text}")
                said = text

            yield Progress(total, say)
            self.say("100 %")
            return
        times = bars.TimeElapsedColumn(), bars.TextColumn("left"), bars.TimeRemainingColumn()
        columns = bars.TextColumn("{task.description}"), bars.BarColumn(), bars.TaskProgressColumn(), *times
        with bars.Progress(*columns, console=Console(file=self.out)) as bar:
            task = bar.add_task("", total=100.0)
            yield Progress(total, lambda percent, text: bar.update(task, description=text, completed=percent, refresh=True))


class Progress:
    """Work done so far of a `total`, in units of the caller's choice; `show` is told how far it is [%], and with what."""

    def __init__(self, total: float, show: Show) -> None:
        self.total = total
        self.show = show
        self.done = 0.0
        self.text = ""

    @contextmanager
    def step(self, text: str, work: float) -> Generator[None]:
        """Show `text` while the body runs; count `work` units as done after it."""
        self.text = text
        self.within(0.0)
        yield
        self.done += work
        self.within(0.0)

    def within(self, work: float) -> None:
        """Show `work` units of the step under way as done."""
        self.show(min(100.0, 100.0 * (self.done + work) / self.total), self.text)
