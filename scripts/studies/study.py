# SPDX-License-Identifier: GPL-3.0-or-later
"""What every study is made of: steps that yield records, and tables of these. No bpy."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from true_diffuse.addon.measure.record import Progress, Record

type Table = tuple[tuple[str, ...], list[tuple[str, ...]]]  # columns and rows, for people


class Step(NamedTuple):
    """A part of a study: its name, what measures it, and how much work that is beside the other steps."""

    name: str
    measure: Callable[[], Iterable[Record]]
    work: float = 1.0


class Section(NamedTuple):
    """A part of a report: what is measured, and tables of all its records by their titles."""

    steps: Sequence[Step]
    tables: Mapping[str, Callable[[Sequence[Record]], Table]]


def run(steps: Iterable[Step], progress: Progress) -> Iterator[Record]:
    """Yield the records of `steps`, one after the other."""
    for step in steps:
        with progress.step(step.name, step.work):
            found = list(step.measure())
        yield from found


def pivot(
    records: Iterable[Record],
    titles: Sequence[str],
    row: Callable[[Record], tuple[str, ...]],
    column: Callable[[Record], str],
    cell: Callable[[list[Record]], str],
) -> Table:
    """Return a table with a row for each `row` of the records, which stands under `titles`, and a column for each `column`.

    `cell` writes the records that share both; there is a "-" where none do.
    """
    columns: dict[str, None] = {}
    rows: dict[tuple[str, ...], dict[str, list[Record]]] = {}
    for record in records:
        columns[column(record)] = None
        rows.setdefault(row(record), {}).setdefault(column(record), []).append(record)
    texts = [(*key, *(cell(cells[name]) if name in cells else "-" for name in columns)) for key, cells in rows.items()]
    return (*titles, *columns), texts


def text(value: float | None, form: str = "g") -> str:
    """Return a number in a format of Python's; "-" for None."""
    return "-" if value is None else format(value, form)


def percent(fraction: float | None, form: str = ".2f") -> str:
    """Return a fraction in percent, without the sign; "-" for None."""
    return "-" if fraction is None else format(100.0 * fraction, form)


def number_or_name(x: float) -> float | str:
    """Return `x`, or its name where JSON has no number for it."""
    return x if math.isfinite(x) else str(x)
