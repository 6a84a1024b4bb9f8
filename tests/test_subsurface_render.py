# SPDX-License-Identifier: GPL-3.0-or-later
"""Light scattered below the surface of a slab, as Blender's own Subsurface Scattering and the group render it."""

import math
from xml.etree import ElementTree

import bpy

import pytest
from mathutils import Matrix

from true_diffuse.addon.blender import engines
from true_diffuse.addon.closures.subsurface_fit import BEAM
from true_diffuse.addon.material import materials
from true_diffuse.addon.models.burley import Burley
from true_diffuse.addon.models.half_space import diffusion_root
from true_diffuse.addon.nodes import SUBSURFACE
from true_diffuse.scenes.slab import slab
from true_diffuse.scripts.fit.subsurface import DEPTHS, transmitted
from true_diffuse.scripts.studies import searchlight, slab_light
from true_diffuse.scripts.studies import subsurface as study
from true_diffuse.scripts.studies.edge_profile import edge_width
from true_diffuse.scripts.studies.study import run
from true_diffuse.scripts.studies.work_precision.test_scenes import Silent

COLORS = (0.8, 0.5, 0.1)
D = 2.0  # mm, of Burley's profile
# Cycles ends Burley's profile at 16 d and makes up for it: everything nearer is more by 1 / 0.99638.
TRUNCATION = Burley(D).cdf(16.0 * D)


def plain(radius: float) -> bpy.types.Material:
    """Return Blender's own Christensen-Burley; `radius` in mm."""
    material = bpy.data.materials.new("Plain")
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new("ShaderNodeSubsurfaceScattering"), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    node.falloff = "BURLEY"
    node.inputs["Color"].default_value = (*COLORS, 1.0)
    node.inputs["Radius"].default_value, node.inputs["Scale"].default_value = (radius,) * 3, 0.001
    return material


@pytest.mark.parametrize("steps", [16.0, 6.0])
def test_edge_width_of_an_exponential_profile(steps: float) -> None:
    # e^(-|x|) / 2: the response is e^x / 2 below the edge, 25 % at -ln 2
    expected = 2.0 * math.log(2.0)
    positions = [(k - 63.5) * expected / steps for k in range(128)]
    values = [0.5 * math.exp(x) if x < 0.0 else 1.0 - 0.5 * math.exp(-x) for x in positions]
    assert edge_width([3.0 * value for value in values], expected / steps) == pytest.approx(expected, rel=1e-9)


def test_edge_width_of_a_logistic_edge() -> None:
    # it bends the other way: 25 % at -ln 3
    values = [1.0 / (1.0 + math.exp((63.5 - k) * 0.2)) for k in range(128)]
    assert edge_width(values, 0.2) == pytest.approx(2.0 * math.log(3.0), rel=2e-3)


@pytest.mark.parametrize("values", [[0.5] * 16, [0.0] * 16, [0.0] * 8 + [1.0] * 8], ids=["gray", "black", "step"])
def test_edge_width_is_nan_where_no_edge_shows(values: list[float]) -> None:
    assert math.isnan(edge_width(values, 1.0))


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_cycles_burley_spreads_light_as_the_closed_form_says() -> None:
    burley, radii = Burley(D), [0.2 * D, 0.6 * D, 1.8 * D, 5.4 * D]
    shares = slab_light.rings(slab(200.0 * D), plain(4.0 * math.pi * D), engines.CYCLES, 512, radii)
    for color, found in zip(COLORS, shares, strict=True):
        for k, got in enumerate(found):
            expected = color * (burley.cdf(radii[k + 1]) - burley.cdf(radii[k])) / TRUNCATION
            # 131,000 paths, of which a share of 0.1 and more ends in a ring: 0.8 % is one standard deviation
            assert got == pytest.approx(expected, rel=0.025)


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
@pytest.mark.parametrize("scale_length", [1.0, 0.01], ids=["metres", "centimetres"])
def test_slab_is_in_millimetres_in_scenes_of_any_unit(scale_length: float) -> None:
    view, size = 4.0 * 1.633 * D, (64, 32)
    material = plain(4.0 * math.pi * D / scale_length)
    profile = slab_light.edge(slab(200.0 * D, scale_length=scale_length), material, engines.CYCLES, 256, size, view)[0]
    # 8200 paths in a column, 5 or 6 columns at either side of each crossing: 1.3 % of the width
    assert edge_width(profile, view / size[0]) == pytest.approx(1.633036 * D, rel=0.04)


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
@pytest.mark.parametrize("method", [study.WALK, study.BURLEY], ids=lambda method: method.entry)
def test_evenly_lit_slab_shows_the_color(method: study.Method) -> None:
    shown = study.material(method, COLORS, (1.0,) * 3)
    (found,) = slab(1000.0).albedos([shown], engines.CYCLES, 512)
    for color, mean in zip(COLORS, found, strict=True):
        # what Random Walk shows along the normal is up to 2 % below what it shows on the average of all views
        assert mean.value == pytest.approx(color, abs=0.02 * color + 4.0 * mean.noise)


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
@pytest.mark.parametrize("mu", [1.0, 0.3])
def test_cells_keep_to_themselves(mu: float) -> None:
    body = slab(1000.0, 2, 2)
    colors = (0.2, 0.4, 0.6, 0.8)
    shown = [study.material(study.BURLEY, (color,) * 3, (1.0,) * 3) for color in colors]
    for color, channels in zip(colors, body.albedos(shown, engines.CYCLES, 64, mu), strict=True):
        assert [mean.value for mean in channels] == pytest.approx([color] * 3, rel=0.02)


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_group_has_the_profile_of_its_model() -> None:
    records = list(run(study.profile([engines.CYCLES], True), Silent()))
    fields = {"case", "engine", "method", "quantity", "expected", "got", "error", "noise"}
    assert all(set(record) == fields for record in records)
    # 262,000 paths, of which a share of 0.03 and more ends in a ring: 1.1 % is one standard deviation at most
    assert records[-1]["got"] <= 0.02
    columns, rows = study.table(records)
    assert len(rows) == len(records)
    assert all(len(row) == len(columns) for row in rows)


def test_searchlight_diagram_shows_every_curve() -> None:
    records = [
        {"engine": "cycles", "method": "Random Walk", "rendered": 0.4 / k, searchlight.BURLEY: 0.5 / k, searchlight.DIPOLE: 0.1 / k}
        for k in range(1, len(searchlight.RADII))
    ]
    records[-1]["rendered"] = 0.0  # no path came there: left out
    root = ElementTree.fromstring(searchlight.svg(records, 600, 400))
    lines = [line.get("points", "").split() for line in root.iter("{http://www.w3.org/2000/svg}polyline")]
    count = len(searchlight.RADII) - 1
    assert [len(points) for points in lines] == [count, count, count - 1]
    for points in lines:
        x, y = zip(*(map(float, point.split(",")) for point in points), strict=True)
        assert list(x) == sorted(x)
        assert list(y) == sorted(y)  # all fall, and SVG's y points down
        assert all(0.0 < value < 600.0 for value in x)
        assert all(0.0 < value < 400.0 for value in y)


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
@pytest.mark.parametrize("depth", [2.0, 30.0])
def test_eevee_lets_light_through_a_slab_as_walks_do(depth: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """`depth` in mean free paths; the sun is below the slab, as steep as `through_radius` takes light for."""
    monkeypatch.setattr("true_diffuse.scenes.slab.SHADOW_STEPS", 64.0)  # a depth comes out too long by a step or two
    color, length, cell = 0.5, 2.0, 240.0  # mm
    body = slab(cell)
    body.body.data.transform(Matrix.Diagonal((1.0, 1.0, depth * length / cell, 1.0)))
    alpha = BEAM.albedo(color)
    steep = 1.0 / (1.5 - 0.3 * diffusion_root(alpha))
    body.sun.matrix_world = Matrix.Rotation(math.pi - math.acos(steep), 4, "Y")
    material = materials.create("Wax", SUBSURFACE, Color=(color, color, color, 1.0), Specular=0.0)
    material.node_tree.nodes[SUBSURFACE.name].inputs["Subsurface Radius"].default_value = (length,) * 3
    ((red, _, _),) = body.albedos([material], engines.EEVEE, 4, mu=0.9)
    expected = steep * transmitted(alpha, 4000)[min(range(len(DEPTHS)), key=lambda k: abs(DEPTHS[k] - depth))]
    # The profile has one radius for all depths, and at most the color: 26 % too little at 2 mean free paths by its formula.
    # A depth is too long by one step of the shadow map and more, 0.2 mm, which is 4 % of the light.
    assert red.value == pytest.approx(expected, rel=0.35, abs=0.002)
