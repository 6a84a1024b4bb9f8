# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs at the ends of their ranges and beyond: whether what the node groups make of them is finite and not negative."""

import math
from collections.abc import Iterable, Iterator, Sequence
from functools import partial

import bpy

from true_diffuse.addon.blender.engines import Engine
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.nodes import chosen_lights
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scripts.studies.rough import (
    EVERY,
    QUICK_MODELS,
    SPECULAR,
    SPECULAR_CONFIGURATIONS,
    Configuration,
    MeasuredModel,
    configurations,
)
from true_diffuse.scripts.studies.sheet import USUAL, Inputs, Sheet, fed, inputs_of, sheet
from true_diffuse.scripts.studies.study import Step, Table, pivot

MUS = (1.0, 0.5, 0.05, 0.01)
CELL = 3  # pixels across
SUNS = (0.0, 60.0, 175.0)  # degrees between sun and viewer: N = L = V in the first column, L next to -V in the last one
NAN, INF = math.nan, math.inf
NUMBERS: dict[str, tuple[float, ...]] = {
    "Roughness": (0.0, 1e-8, 1e-3, math.pi / 2, 1e3, -1.0, INF, NAN),
    "Color": (0.0, 1.0, 1.5, -1.0, INF, NAN),
    "IOR": (1.0, 3.0, 0.0, -1.0, INF, NAN),
    "Specular": (0.0, 1.0, 1e3, -1.0, INF, NAN),
    "Exponent": (0.0, 1e4, 1e6, -1.0, INF, NAN),
}
NORMALS = (
    ("length 0", (0.0, 0.0, 0.0)),
    ("length 1e-20", (0.0, 0.0, 1e-20)),
    ("length 1e20", (0.0, 0.0, 1e20)),
    ("length 3e38", (0.0, 0.0, 3e38)),
    ("away from the viewer", (0.0, 0.0, -1.0)),
    ("across the view", (1.0, 0.0, 0.0)),
    ("NaN", (NAN, NAN, NAN)),
    ("one NaN", (0.0, NAN, 1.0)),
    ("infinite", (0.0, 0.0, INF)),
)


def rows_of(measured: MeasuredModel) -> list[tuple[str, str, Inputs]]:
    """Return what the rows of a sheet for a model's group are: the input that is odd, its value in words, and all inputs."""
    rows = []
    for name in inputs_of(measured):
        rows += [(name, f"{value:g}", {**USUAL, name: (value,) * 3}) for value in NUMBERS.get(name, ())]
    return rows + [("Normal", words, {**USUAL, "Normal": value}) for words, value in NORMALS]


def extremes(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the least and the greatest radiance that each odd input gives, over views, suns and a uniform world.

    `finite` is whether all of it is finite and not negative.
    """
    white = uniform_world()
    rough = configurations(used, QUICK_MODELS if quick else tuple(EVERY.values()))
    steps = []
    for cases in (rough, configurations(used, (SPECULAR,), SPECULAR_CONFIGURATIONS)):
        rows = rows_of(cases[0][1])
        bent = sheet(MUS, [inputs for _, _, inputs in rows], CELL)
        for one, each in cases:
            steps.append(Step(f"Extremes  {one.name}  {each.name}", partial(_measure, bent, rows, (*SUNS, white), one, each)))
    return steps


def _measure(
    bent: Sheet,
    rows: Sequence[tuple[str, str, Inputs]],
    lights: "Iterable[float | bpy.types.World]",
    configuration: Configuration,
    measured: MeasuredModel,
) -> Iterator[Record]:
    chosen_lights.choose([bent.sun])
    bent.scene.cycles.shading_system = configuration.osl
    ranges = odd_inputs(bent, fed(measured, configuration.quality), configuration.engine, lights)
    about = {**configuration.record, "model": measured.name}
    for (name, words, _), (low, high, finite) in zip(rows, ranges, strict=True):
        yield {**about, "input": name, "value": words, "minimum": low, "maximum": high, "finite": finite}


def odd_inputs(
    bent: Sheet, material: bpy.types.Material, engine: Engine, lights: "Iterable[float | bpy.types.World]"
) -> list[tuple[float | None, float | None, bool]]:
    """Return, for each row of a sheet, the least and the greatest finite value, and whether all are finite and none negative."""
    values: list[list[float]] = [[] for _ in range(bent.rows)]
    for light in lights:
        for index, cell in enumerate(bent.cells(material, engine, 1, light)):
            values[index // bent.columns] += cell
    result = []
    for row in values:
        finite = [value for value in row if math.isfinite(value)]
        low, high = min(finite, default=None), max(finite, default=None)
        result.append((low, high, len(finite) == len(row) and low is not None and low >= 0.0))
    return result


def table(records: Sequence[Record]) -> Table:
    """Return a row for each input and value: the range over all models of each target and quality."""

    def row(one: Record) -> tuple[str, ...]:
        return one["input"], one["value"]

    def column(one: Record) -> str:
        return f"{one['engine']}, {one['target']}, {one['quality']}"

    return pivot(records, ("Input", "Value"), row, column, _range)


def _range(records: Sequence[Record]) -> str:
    lows = [record["minimum"] for record in records if record["minimum"] is not None]
    highs = [record["maximum"] for record in records if record["maximum"] is not None]
    text = f"{min(lows):.3g} to {max(highs):.3g}" if lows else "none"
    return text if all(record["finite"] for record in records) else f"{text}, NOT SOUND"
