# SPDX-License-Identifier: GPL-3.0-or-later
"""The terminal of `console` drawn with rich: progress bars with the time left, and tables."""

import os
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from typing import Self

from rich import progress as bars
from rich.console import Console
from rich.table import Table

from true_diffuse.scripts.cli.console import Progress, Terminal

WIDTH = 100  # of output that goes to a file


class RichTerminal(Terminal):
    """A `Terminal` for people."""

    def __enter__(self) -> Self:
        super().__enter__()
        self.console = Console(file=self.out, width=None if os.isatty(self.out.fileno()) else WIDTH)
        return self

    def say(self, text: str) -> None:
        self.console.print(text, markup=False, highlight=False, soft_wrap=True)

    def table(self, title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
        table = Table(title=title)
        for index, column in enumerate(columns):
            table.add_column(column, justify="left" if index < 2 else "right")
        for row in rows:
            table.add_row(*row)
        self.console.print(table)

    @contextmanager
    def progress(self, total: float) -> Generator["RichProgress"]:
        columns = (
            bars.TextColumn("{task.description}"),
            bars.BarColumn(),
            bars.TaskProgressColumn(),
            bars.TimeElapsedColumn(),
            bars.TextColumn("left"),
            bars.TimeRemainingColumn(),
        )
        with bars.Progress(*columns, console=self.console) as bar:
            yield RichProgress(self, total, bar)


class RichProgress(Progress):
    """A `Progress` shown as a bar."""

    def __init__(self, terminal: Terminal, total: float, bar: bars.Progress) -> None:
        super().__init__(terminal, total)
        self.bar = bar
        self.task = bar.add_task("", total=total)

    @contextmanager
    def step(self, text: str, work: float) -> Generator[None]:
        with super().step(text, work):
            yield
        self.within(0.0)

    def within(self, work: float) -> None:
        self.bar.update(self.task, completed=self.done + work)
        self.bar.refresh()

    def show(self, text: str, done: float) -> None:
        self.bar.update(self.task, description=text, completed=done)
        self.bar.refresh()
