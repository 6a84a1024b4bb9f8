# SPDX-License-Identifier: GPL-3.0-or-later
"""What a batch is made of, as people write it: characters with patterns of files, frames as ranges. No bpy."""

import glob
import os
import re
from collections.abc import Sequence
from pathlib import Path

MOST_FRAMES = 100_000
RANGE = re.compile(r"(-?\d+)(?:-(-?\d+)(?::(\d+))?)?")


def frame_numbers(text: str) -> tuple[int, ...]:
    """Return the frames of "1-24", "1-24:4" (every fourth) or "1,5,9-12", in order, each once; raises ValueError for other text."""
    frames: set[int] = set()
    for part in text.split(","):
        found = RANGE.fullmatch(part.strip())
        if not found:
            raise ValueError(f"{text!r} is not a list of frames as 1-24, 1-24:4 or 1,5,9-12")
        first = int(found[1])
        last, step = int(found[2] or first), int(found[3] or 1)
        if last < first or step == 0:
            raise ValueError(f"{part.strip()!r} holds no frame")
        if (last - first) // step + len(frames) >= MOST_FRAMES:
            raise ValueError(f"at most {MOST_FRAMES} frames")
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


def characters(given: Sequence[str], included: Sequence[str]) -> dict[str, str]:
    """Return what is `given` by a name of its own each: one of the `included`, or the full path of a file.

    A pattern (*, ?, [], ** for folders of any depth) stands for all files that match it. Raises ValueError for one that none does.
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
                raise ValueError(f"no file matches {each}")
            found += matching
    named: dict[str, str] = {}
    for who in dict.fromkeys(found):
        stem = re.sub(r"[^\w.-]+", "_", Path(who).stem) or "character"
        name, again = stem, 2
        while name in named:
            name, again = f"{stem}_{again}", again + 1
        named[name] = who
    return named


def _full(path: Path) -> str:
    return os.path.normpath(path.absolute())
