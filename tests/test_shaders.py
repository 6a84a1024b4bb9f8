# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders: GLSL on the driver against the models in double precision, OSL compiled and rendered by Cycles."""

import math
import random
import struct

import pytest
from glsl import SHADERS, evaluate
from true_diffuse.addon import engines, materials
from true_diffuse.addon.models import Lambert, Model, OrenNayar, Specular
from true_diffuse.addon.models.lobes import CyclesLobes
from true_diffuse.addon.models.vector import Vector, dot, from_polar, normalize
from true_diffuse.scenes.sphere import COLOR, sphere_under_sun

COUNT = 4000
SIGMA = 0.33
CASES = [
    pytest.param("lambert", "lambert_radiance(a.xyz, b.xyz, c.xyz, vec3(0.7))", Lambert(), id="lambert"),
    pytest.param(
        "oren_nayar",
        f"oren_nayar_radiance(a.xyz, b.xyz, c.xyz, vec3(0.7), oren_nayar_coefficients({SIGMA}))",
        OrenNayar(SIGMA),
        id="oren_nayar",
    ),
    pytest.param("specular", "specular_radiance(a.xyz, b.xyz, c.xyz, vec3(0.7), 0.2, 30.0)", Specular(0.2, 30.0), id="specular"),
]


def single(vector: Vector) -> Vector:
    """Round to 32-bit floats, so that both sides start from the same numbers."""
    x, y, z = struct.unpack("3f", struct.pack("3f", *vector))
    return x, y, z


def directions() -> list[tuple[Vector, Vector, Vector]]:
    """Random N, L, V, and the hard ones: grazing, behind, all alike, light at the viewer, opposite azimuth."""
    dice = random.Random(1)

    def anywhere() -> Vector:
        return single(normalize((dice.gauss(0, 1), dice.gauss(0, 1), dice.gauss(0, 1))))

    n = (0.0, 0.0, 1.0)
    cosines = (-0.5, 0.0, 1e-8, 1e-4, 0.5, 1.0 - 1e-8, 1.0)
    lights = [single(from_polar(mu, azimuth)) for mu in cosines for azimuth in (0.0, 1.0, math.pi)]
    views = [single(from_polar(mu, 0.0)) for mu in cosines]
    return [(anywhere(), anywhere(), anywhere()) for _ in range(COUNT)] + [(n, l, v) for l in lights for v in views]


@pytest.mark.render
@pytest.mark.parametrize(("stem", "call", "model"), CASES)
def test_glsl_equals_the_model(stem: str, call: str, model: Model, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    rows = directions()
    for (n, l, v), got in zip(rows, evaluate(stem, call, rows), strict=True):
        if min(abs(dot(n, l)), abs(dot(n, v))) < 1e-6 and got == (0.0, 0.0, 0.0):
            continue  # on the horizon a 32-bit dot product may fall to the other side
        expected = model.radiance(n, l, v, 0.7)
        assert all(math.isfinite(value) and value >= 0.0 for value in got)
        # 32-bit dot products: three roundings of 2^-24 each, up to 30 times as much behind the highlight's power
        assert got == pytest.approx((expected,) * 3, rel=2e-5, abs=1e-6), (n, l, v)


@pytest.mark.parametrize("path", sorted(SHADERS.glob("*.glsl")), ids=lambda path: path.stem)
def test_glsl_says_what_it_is(path) -> None:
    header = path.read_text().splitlines()[:8]
    assert header[0] == "// SPDX-License-Identifier: GPL-3.0-or-later"
    assert any("functions only, no bindings" in line for line in header)


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_osl_renders_as_its_model() -> None:
    sphere = sphere_under_sun(64)
    sphere.scene.cycles.shading_system = True
    for sigma in (0.2, 1.0):
        material = materials.create_osl("OSL", "oren_nayar", Color=COLOR, Sigma=sigma)
        own, paper = sphere.measure(material, [CyclesLobes(sigma), OrenNayar(sigma)], engines.CYCLES, 4, 60.0)[1]
        assert own.rms < 0.002  # the pixel filter's 0.01 pixels
        assert paper.rms < 0.013  # what the lobes leave at sigma = 1
