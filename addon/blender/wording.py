# SPDX-License-Identifier: GPL-3.0-or-later
"""Numbers and lists in the sentences that are shown to the user. No bpy."""

from collections.abc import Sequence

MOST_NAMES = 4  # of a list in the status bar


def counted(number: int, noun: str) -> str:
    """Return `number` and its `noun`, which gets an s unless there is one of it: "1 material", "2 materials"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"


def listed(names: Sequence[str], most: int = MOST_NAMES) -> str:
    """Return `names` in one line; of more than `most` the first, and how many more there are."""
    if len(names) <= most:
        return ", ".join(names)
    return f"{', '.join(names[: most - 1])} and {len(names) - most + 1} more"


def counted_names(names: Sequence[str], noun: str) -> str:
    """Return how many of `noun` there are, and their `names`: "3 materials: Skin, Shirt, Boots"; "no material" of none."""
    return f"{counted(len(names), noun)}: {listed(names)}" if names else f"no {noun}"
