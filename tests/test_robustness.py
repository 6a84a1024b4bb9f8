# SPDX-License-Identifier: GPL-3.0-or-later
"""The node group in a white furnace, lit from behind, and with inputs beyond all ranges, in both engines."""

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.models import directional_albedo
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.addon.nodes.chosen_lights import choose
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scripts.studies import furnace, hard_inputs, light_leaks, sheet
from true_diffuse.scripts.studies.rough import EON, PAPER, SPECULAR, MeasuredModel

pytestmark = [pytest.mark.usefixtures("empty_file"), pytest.mark.render]

MUS = furnace.MUS
# Cycles' noise: a cell of 36 pixels with 256 samples deviates by 0.5 %, its samples by half their mean; and what the lobes' own
# albedo is off by. EEVEE keeps the light of a world in floats of 6 bits after the point, blue in 5, cut off: 1/64, 1/64 and 1/32 at
# the most, 2 % in the mean of the channels. It does not cut a world off at the horizon of a bent lobe, so there is too much of it.
CYCLES_NOISE, EEVEE_BITS = 0.01, 0.021
EEVEE_GAIN = {"Oren-Nayar": 0.12, "EON": 0.08}  # at sigma = 0.33, N.V = 0.05: 0.111 and 0.065


eon_and_paper = pytest.mark.parametrize("measured", [EON, PAPER], ids=["EON", "Oren-Nayar"])


def white(measured: MeasuredModel, engine: engines.Engine, samples: int, osl: bool = False) -> list[float]:
    """Return the fraction of a uniform world that a white surface of roughness 0.33 reflects, for each of MUS."""
    bent = sheet.sheet(MUS, [sheet.USUAL], furnace.CELL)
    bent.scene.cycles.shading_system = osl
    material = materials.create("White", ROUGH_DIFFUSE, Model=measured.name, Color=(1.0,) * 4, Roughness=0.33)
    cells = bent.cells(material, engine, samples, uniform_world())
    return [sum(cell) / len(cell) for cell in cells]


@pytest.mark.parametrize("osl", [False, True], ids=["nodes", "osl"])
@eon_and_paper
def test_white_furnace_in_cycles_shows_the_albedo_of_the_formula(measured: MeasuredModel, osl: bool) -> None:
    for rendered, mu in zip(white(measured, engines.CYCLES, 256, osl), MUS, strict=True):
        assert rendered == pytest.approx(directional_albedo(measured.formula(0.33), mu), abs=CYCLES_NOISE), mu


@eon_and_paper
@pytest.mark.usefixtures("driver")
def test_white_furnace_in_eevee_shows_no_more_than_the_known_gain(measured: MeasuredModel) -> None:
    for rendered, mu in zip(white(measured, engines.EEVEE, 1), MUS, strict=True):
        excess = rendered - directional_albedo(measured.formula(0.33), mu)
        assert -EEVEE_BITS < excess < EEVEE_GAIN[measured.name], mu


@pytest.mark.parametrize("thickness", [None, 0.001], ids=["sphere", "slab of 1 mm"])
def test_closed_body_shows_no_light_from_behind(engine: engines.Engine, thickness: float | None) -> None:
    solid = light_leaks.body(thickness)
    choose([solid.sun])
    material = materials.create("Rough", ROUGH_DIFFUSE, Model="Oren-Nayar", Color=light_leaks.COLOR, Roughness=1.0)
    for shadows in (False, True) if thickness is None else (False,):
        assert solid.leak(material, engine, 120.0, shadows) == 0.0


NODES = [(PAPER, "Balanced"), (SPECULAR, "Balanced"), (SPECULAR, "Exact for Chosen Lights")]


@pytest.mark.parametrize(
    ("engine", "measured", "quality", "osl"),
    [
        *(("eevee", *nodes, False) for nodes in NODES),
        *(("cycles", *nodes, False) for nodes in (*NODES, (PAPER, "Exact for Chosen Lights"))),
        ("cycles", PAPER, "Balanced", True),
    ],
    indirect=["engine"],
    ids=lambda value: getattr(value, "name", None),
)
def test_odd_inputs_render_finite_and_not_negative(
    engine: engines.Engine, measured: MeasuredModel, quality: str, osl: bool
) -> None:
    rows = hard_inputs.rows_of(measured)
    bent = sheet.sheet(hard_inputs.MUS, [inputs for _, _, inputs in rows], hard_inputs.CELL)
    choose([bent.sun])
    lights: list[float | bpy.types.World] = [*hard_inputs.SUNS, uniform_world()]
    bent.scene.cycles.shading_system = osl
    material = sheet.fed(measured, quality)
    for (name, words, _), (low, _, finite) in zip(rows, hard_inputs.odd_inputs(bent, material, engine, lights), strict=True):
        assert finite, (name, words, low)


@pytest.mark.parametrize(("odd", "usual"), [("NaN", "length 0"), ("length 1e20", "towards the viewer")])
def test_normal_without_a_direction_counts_as_none(odd: str, usual: str) -> None:
    normals = {**dict(hard_inputs.NORMALS), "towards the viewer": (0.0, 0.0, 1.0)}
    rows = [{**sheet.USUAL, "Normal": normals[words]} for words in (odd, usual)]
    bent = sheet.sheet(MUS[:2], rows, hard_inputs.CELL)
    cells = bent.cells(sheet.fed(PAPER, "Balanced"), engines.CYCLES, 1, 60.0)
    for one, other in zip(cells[:2], cells[2:], strict=True):
        assert max(other) > 0.1 and one == pytest.approx(other, rel=1e-5)  # the same shading in 32-bit floats
