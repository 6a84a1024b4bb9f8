# SPDX-License-Identifier: GPL-3.0-or-later
"""Imports point one way: a room uses only the rooms below it, and what ships uses nothing that does not."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
# From the bottom: a module imports from its own room and from those on earlier lines. addon/__init__.py is on top of addon.
ORDER = (
    ("addon/models",),
    ("addon/closures",),
    ("addon/blender",),
    ("addon/nodes",),
    ("addon/material",),
    ("addon/measure", "addon/realtime", "addon/usd"),
    ("addon/gltf",),
    ("scenes",),
    ("addon/probe",),
    ("addon/operators",),
    ("addon/ui", "addon/handlers"),
    ("addon",),
    ("scripts/characters", "scripts/web"),
    ("scripts/studies",),
    ("scripts/cli",),
    ("scripts/census", "scripts/farm", "scripts/fit", "scripts/viewer"),
    ("scripts/release",),
    ("scripts",),
    ("tests",),
)
RANKS = {room: rank for rank, rooms in enumerate(ORDER) for room in rooms}
STARTS = "scripts/checkout.py"  # makes the checkout a package: every script imports it first


def room_of(path: Path) -> str:
    """The room that a file lies in, deepest first."""
    return next(str(folder) for folder in path.parents if str(folder) in RANKS)


def imported(path: Path) -> Iterator[Path]:
    """The project's own files that the file at `path`, relative to ROOT, imports anywhere in it."""
    for node in ast.walk(ast.parse((ROOT / path).read_text())):
        if not isinstance(node, ast.ImportFrom):
            continue
        module = (node.module or "").split(".") if node.module else []
        if node.level:
            base = path.parents[node.level - 1]
        elif module[:1] == ["true_diffuse"]:
            base, module = Path(), module[1:]
        else:
            continue
        base = base.joinpath(*module)
        for place in (base, *(base / alias.name for alias in node.names)):
            for file in (place.with_suffix(".py"), place / "__init__.py"):
                if place != Path() and (ROOT / file).is_file():
                    yield file


FILES = [path.relative_to(ROOT) for room in ("addon", "scenes", "scripts") for path in sorted((ROOT / room).rglob("*.py"))]


@pytest.mark.parametrize("path", FILES, ids=str)
def test_imports_point_down(path: Path) -> None:
    own = room_of(path)
    above = [str(file) for file in imported(path) if room_of(file) != own and RANKS[room_of(file)] >= RANKS[own]]
    assert [file for file in above if file != STARTS] == []


@pytest.mark.parametrize("room", ["addon/models", "addon/closures"])
def test_formulas_need_no_blender(room: str) -> None:
    blender = {"bpy", "gpu", "mathutils", "bmesh", "imbuf"}
    for path in (ROOT / room).glob("*.py"):
        nodes = list(ast.walk(ast.parse(path.read_text())))
        names = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
        names |= {node.module or "" for node in nodes if isinstance(node, ast.ImportFrom) and not node.level}
        assert not {name.split(".")[0] for name in names} & blender, path
