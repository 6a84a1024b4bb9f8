# SPDX-License-Identifier: GPL-3.0-or-later
"""The face's scene, and the comparison of engines by regions of skin."""

from array import array
from itertools import pairwise

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.scripts.characters import character, face
from true_diffuse.scripts.characters.human import REGION_ATTRIBUTE, REGIONS
from true_diffuse.scripts.studies import face as study

pytestmark = pytest.mark.usefixtures("empty_file")


def test_human_has_every_region_on_both_sides() -> None:
    mesh = character.load("human")
    regions = mesh.attributes[REGION_ATTRIBUTE].data
    centers = {region: [] for region in REGIONS}
    for polygon in mesh.polygons:
        centers[REGIONS[regions[polygon.index].value]].append(polygon.center)
    for region in REGIONS:
        xs = [center.x for center in centers[region]]
        assert min(xs) < -0.005 and max(xs) > 0.005
    mean = {region: sum(p.z for p in centers[region]) / len(centers[region]) for region in REGIONS}
    assert mean["forehead"] > mean["eyes"] > mean["nose"] > mean["nostrils"]
    assert min(abs(center.x) for center in centers["ears"]) > 0.05  # m, on the sides of the head
    assert min(center.z for center in centers["other skin"]) > 1.3  # the hands wear gloves


@pytest.mark.parametrize("who", ["human", "monkey"])
def test_only_skin_scatters(who: str) -> None:
    stage = face.build(character.load(who), who == "human", (300, 120))
    for head in stage.heads:
        other, eyes, skin = (slot.material for slot in head.subject.material_slots)
        used = {polygon.material_index for polygon in head.subject.data.polygons}
        assert used == ({0, 1, 2} if who == "human" else {2})
        group = skin.node_tree.nodes["Subsurface"].inputs
        assert group["Subsurface"].default_value == pytest.approx(head.look.inputs["Subsurface"])
        assert group["Scale"].default_value == 1.0  # the published lengths as they are
        assert tuple(group["Subsurface Radius"].default_value) == pytest.approx(PRESETS["skin_2"].inputs["Subsurface Radius"])
        assert eyes.node_tree.nodes["Subsurface"].inputs["Subsurface"].default_value == 0.0
        assert "Subsurface" not in other.node_tree.nodes


def test_heads_stand_side_by_side() -> None:
    stage = face.build(character.load("human"), True, (1200, 480))
    edges = []
    for head in stage.heads:
        xs = [(head.subject.matrix_world @ vertex.co).x for vertex in head.subject.data.vertices]
        edges.append((min(xs), max(xs)))
    assert all(left[1] <= right[0] + 1e-5 for left, right in pairwise(edges))


def test_difference_is_without_noise() -> None:
    """Two renders of 1 with independent noise: EEVEE is 10 % off the true value, Realtime 20 %."""
    look = face.LOOKS[0]
    first = array("f", [x for x in (1.2, 1.2, 0.8, 0.8) for _ in range(3)])
    second = array("f", [x for x in (1.2, 0.8, 1.2, 0.8) for _ in range(3)])
    measured = [
        study.Measurement(look, engines.CYCLES, 4, 1.0, (first, second)),
        study.Measurement(look, engines.EEVEE, 4, 1.0, (array("f", [1.1] * 12),)),
        study.Measurement(look, engines.REALTIME, 4, 1.0, (array("f", [0.8] * 12),)),
    ]
    (record,) = study.records([study.VisibleRegions(look, {"ears": [0, 1, 2, 3]})], measured)
    assert record["rms_difference"] == {"eevee": pytest.approx(0.1, rel=1e-5), "realtime": pytest.approx(0.2, rel=1e-5)}
    assert record["noise"] == pytest.approx((2 * 0.4**2 / (4 + 4 * 0.2**2)) ** 0.5 / 2, rel=1e-5)
    assert record["mean_radiance"]["cycles"] == pytest.approx([1.0] * 3)
    assert record["samples"] == {"cycles": 8, "eevee": 4, "realtime": 4}


def test_region_out_of_sight_has_no_difference() -> None:
    look = face.LOOKS[0]
    picture = array("f", [1.0] * 3)
    measured = [study.Measurement(look, engines.CYCLES, 4, 1.0, (picture, picture))]
    (record,) = study.records([study.VisibleRegions(look, {"ears": []})], measured)
    assert record["rms_difference"] == {} and record["noise"] is None and record["mean_radiance"] == {"cycles": None}
    assert study.table([record])[1] == [("brdf", "ears", "0", "-", "-", "-", "-", "-", "-")]
