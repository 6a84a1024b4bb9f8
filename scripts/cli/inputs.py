# SPDX-License-Identifier: GPL-3.0-or-later
"""Types of options: numbers, frames as ranges, and characters with patterns of files. No bpy."""

import glob
import math
import os
import re
from argparse import ArgumentTypeError
from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from pathlib import Path

from true_diffuse.scripts.cli.console import BadInput

MOST_FRAMES = 100_000
LONGEST_NAME = 100  # bytes of a character's name, which is a part of files' names
RANGE = re.compile(r"(-?\d+)(?:-(-?\d+)(?::(\d+))?)?")


def number[Number: (int, float)](kind: type[Number], low: Number, high: Number) -> Callable[[str], Number]:
    """Return the type of an option that takes a number from `low` to `high`."""

    def parse(text: str) -> Number:
        with suppress(ValueError):
            if low <= (value := kind(text)) <= high:
                return value
        raise ArgumentTypeError(f"{text!r} is not a {'whole ' * (kind is int)}number from {low:g} to {high:g}")

    return parse


def names(kind: str, known: Sequence[str]) -> Callable[[str], tuple[str, ...]]:
    """Return the type of an option that takes some of the `known` names, of one `kind`, comma separated."""

    def parse(text: str) -> tuple[str, ...]:
        keys = tuple(dict.fromkeys(part.strip().lower() for part in text.split(",")))
        for key in keys:
            if key not in known:
                raise ArgumentTypeError(f"unknown {kind} {key!r}: choose from {', '.join(known)}")
        return keys

    return parse


sample_count = number(int, 1, 65536)


def frame_numbers(text: str) -> tuple[int, ...]:
    """Return the frames of "1-24", "1-24:4" (every fourth) or "1,5,9-12", in order, each once; raises ArgumentTypeError."""
    frames: set[int] = set()
    for part in text.split(","):
        found = RANGE.fullmatch(part.strip())
        if not found:
            raise ArgumentTypeError(f"{text!r} is not a list of frames as 1-24, 1-24:4 or 1,5,9-12")
        first = int(found[1])
        last, step = int(found[2] or first), int(found[3] or 1)
        if last < first or step == 0:
            raise ArgumentTypeError(f"{part.strip()!r} holds no frame")
        if (last - first) // step + len(frames) >= MOST_FRAMES:
            raise ArgumentTypeError(f"at most {MOST_FRAMES} frames")
        frames.update(range(first, last + 1, step))
    return tuple(sorted(frames))


def frame_range(frames: Sequence[int]) -> str:
    """Return ascending numbers as a range expression of Open Job Description: "1-3,7"."""
    runs: list[list[int]] = []
    for frame in frames:
        if runs and frame == runs[-1][1] + 1:
            runs[-1][1] = frame
        else:
            runs.append([frame, frame])
    return ",".join(str(first) if first == last else f"{first}-{last}" for first, last in runs)


def named_characters(given: Sequence[str], included: Collection[str]) -> dict[str, str]:
    """Return the characters `given`, each under a name of its own: one of the `included`, or the full path of a file.

    A pattern (*, ?, [], ** for folders of any depth) stands for all files that match it. Raises BadInput where none does.
    """
    found: list[str] = []
    for each in given:
        if each in included:
            found.append(each)
        elif Path(each).exists() or not glob.has_magic(each):
            found.append(_full(Path(each)))
        else:
            start = Path(each).anchor
            paths = Path(start or ".").glob(each.removeprefix(start))
            matching = sorted(_full(path) for path in paths if path.is_file())
            if not matching:
                raise BadInput(f"no file matches {each}")
            found += matching
    named: dict[str, str] = {}
    for who in dict.fromkeys(found):
        stem = re.sub(r"[^\w.-]+", "_", Path(who).stem).encode()[:LONGEST_NAME].decode(errors="ignore").lstrip(".-") or "character"
        name, again = stem, 2
        while name in named:
            name, again = f"{stem}_{again}", again + 1
        named[name] = who
    return named


def checked_characters(given: Sequence[str]) -> tuple[dict[str, str], tuple[Path, ...]]:
    """Return what `named_characters` does, and all files that these need, having looked whether they are there. Raises BadInput."""
    from true_diffuse.scripts.characters import character

    named = named_characters(given, character.INCLUDED)
    files: dict[Path, None] = {}
    try:
        for who in named.values():
            if who not in character.INCLUDED:
                files |= dict.fromkeys((Path(who), *character.needs(who)))
    except character.CharacterError as error:
        raise BadInput(str(error)) from error
    return named, tuple(files)


def _full(path: Path) -> str:
    return os.path.normpath(path.absolute())


def percentage(text: str) -> float:
    """The type of an option that takes "2%", "2 %" or "2": the fraction, above 0 and up to 1."""
    try:
        value = float(text.strip().removesuffix("%"))
    except ValueError:
        value = math.nan
    if not 0.0 < value <= 100.0:
        raise ArgumentTypeError(f"{text!r} is not a percentage above 0 and up to 100")
    return value / 100.0
