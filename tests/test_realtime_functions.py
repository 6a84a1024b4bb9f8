# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine has beside the models' radiance, on the driver: directional albedo, coat, normalized diffusion."""

import itertools
import math
import random
import re
from collections.abc import Sequence
from typing import NamedTuple

import bpy

import pytest

from true_diffuse.addon import models
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.glsl import SHADERS
from true_diffuse.addon.closures.coat import mean_fresnel
from true_diffuse.addon.closures.subsurface_fit import edge_width
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS, Formula, directional_albedo
from true_diffuse.addon.models.burley import EDGE_WIDTH_25_75, Burley
from true_diffuse.addon.models.quadrature import gauss_legendre
from true_diffuse.addon.models.vector import Vector, add, dot, from_polar, normalize
from true_diffuse.scenes.sphere import sphere_under_sun
from true_diffuse.scripts.fit import albedo
from true_diffuse.scripts.studies.glsl_values import evaluate

UP = (0.0, 0.0, 1.0)
MUS = (1e-3, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
ROUND = 2e-6  # the rounding of sums of a few numbers up to 1 in 32 bits, with diffuse_asin's 3e-7
HARD = (math.nan, math.inf, -math.inf, -1.0, 0.0, 1e-38, 1e-9, 0.5, 1.0, 2.0, 1e9, 3e38)


@pytest.fixture(autouse=True)
def driver_to_render(request) -> None:
    if request.node.get_closest_marker("render"):
        request.getfixturevalue("driver")


def values(stem: str, call: str, rows: Sequence[tuple[Sequence[float], ...]]) -> list[float]:
    """Return what the float expression `call` gives for each of `rows`."""
    return [value[0] for value in evaluate(stem, f"vec3({call})", rows)]


# ---- directional_albedo.glsl


class Albedo(NamedTuple):
    """A model with its numbers; `arguments` follow mu and rho, with the numbers in b."""

    name: str
    stem: str
    arguments: str
    model: Formula
    value: float
    """Of its parameter."""
    error: float
    """What directional_albedo.glsl states, in units of rho."""

    @property
    def numbers(self) -> tuple[float, ...]:
        return self.model.constants or (0.0,)

    def call(self, mu: str = "a.x", rho: str = "vec3(a.y)") -> str:
        return f"{self.name}_albedo({mu}, {rho}{self.arguments})"


# Of the parameter, by socket; up to sigma = 0.66, above which the 1994 model is cut off at 0
VALUES = {"Roughness": (0.1, 0.33, 0.66), "IOR": (1.0, 1.2, 1.5, 3.0)}
STATED = {"oren_nayar_1994": 0.0011, "wolff": 0.002}


def albedos() -> list[Albedo]:
    """Return every registered model, each with some shapes."""
    listed = []
    for key, model in MODELS.items():
        for value in VALUES[model.parameter.socket] if model.parameter else (0.0,):
            formula = model.formula(*([value] if model.parameter else []))
            arguments = f", b.{'xyzw'[: len(formula.constants)]}" if formula.constants else ""
            stated = 0.0 if value == 1.0 else STATED.get(key, 0.0)  # an index of 1 is Lambert
            listed.append(Albedo(key, model.glsl.albedo_stem or key, arguments, formula, value, stated))
    return listed


every_albedo = pytest.mark.parametrize("albedo", albedos(), ids=lambda albedo: f"{albedo.name}-{albedo.value:.3g}")


@pytest.mark.render
@every_albedo
def test_albedo_is_that_of_its_model(albedo: Albedo) -> None:
    order = 96 if albedo.name == "pitted" else 32  # pits have creases that the quadrature does not know of
    cases = list(itertools.product(MUS, (0.3, 1.0)))
    got = values(albedo.stem, albedo.call(), [(case, albedo.numbers) for case in cases])
    for (mu, rho), value in zip(cases, got, strict=True):
        expected = directional_albedo(albedo.model, mu, rho, order)
        assert value == pytest.approx(expected, abs=albedo.error * rho + ROUND), (mu, rho)


@pytest.mark.render
@pytest.mark.parametrize(("sigma", "low"), [(math.pi / 2, 0.0027), (100.0, 0.0055)])
def test_albedo_of_1994_is_too_low_by_what_it_states_at_high_sigma(sigma: float, low: float) -> None:
    model = models.OrenNayar1994(sigma)
    cases = list(itertools.product((0.005, 0.01, 0.02, 0.1, 0.5), (0.01, 1.0)))
    rows = [(case, (model.a, model.b, model.interreflection)) for case in cases]
    got = values("directional_albedo", "oren_nayar_1994_albedo(a.x, vec3(a.y), b.xyz)", rows)
    errors = [value / rho - directional_albedo(model, mu, rho) / rho for (mu, rho), value in zip(cases, got, strict=True)]
    assert -low < min(errors) < -0.8 * low and max(errors) < 0.0011


@pytest.mark.render
@every_albedo
def test_albedo_is_finite_for_any_cosine_and_color(albedo: Albedo) -> None:
    cases = list(itertools.product(HARD, HARD))
    got = values(albedo.stem, albedo.call(), [(case, albedo.numbers) for case in cases])
    assert all(0.0 <= value < 1.052 for value in got)  # the 1994 model gains 5 % at grazing view
    at = dict(zip(map(str, cases), got, strict=True))
    for hard, as_if in ((math.nan, 0.0), (math.inf, 1.0), (-1.0, 0.0), (2.0, 1.0)):
        assert at[str((hard, 0.5))] == at[str((as_if, 0.5))]
        assert at[str((0.5, hard))] == at[str((0.5, as_if))]


@pytest.mark.render
@pytest.mark.parametrize("name", sorted({albedo.name for albedo in albedos()}))
def test_albedo_channels_have_their_own_color(name: str) -> None:
    albedo = next(albedo for albedo in albedos() if albedo.name == name)
    gray = values(albedo.stem, albedo.call(), [((0.4, rho), albedo.numbers) for rho in (0.25, 0.5, math.nan)])
    assert evaluate(albedo.stem, albedo.call(rho="vec3(0.25, 0.5, a.y)"), [((0.4, math.nan), albedo.numbers)]) == [tuple(gray)]


@pytest.mark.parametrize(("mu", "exponent"), list(itertools.product((0.05, 0.3, 0.7, 1.0), (1.0, 30.0, 300.0))))
def test_quadrature_of_the_highlight_equals_that_over_lights(mu: float, exponent: float) -> None:
    expected = directional_albedo(models.Specular(1.0, exponent), mu, 0.0, 64)
    # NARROW cuts the widest lobes short by 1e-5
    assert albedo.highlight(mu, exponent) == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize("t", [0.3, 1.0, 2.0, 4.0])
def test_quadrature_of_the_highlight_tends_to_a_gaussian_of_facets(t: float) -> None:
    # (N.H)^n is a Gaussian of variance 1 / n, so h is E[(t + y)(t + 2 y); t + 2 y > 0] / n with y normal
    n = 10000.0
    below, density = 0.5 * math.erfc(-t / math.sqrt(8.0)), math.exp(-t * t / 8.0) / math.sqrt(2.0 * math.pi)
    expected = ((t * t + 2.0) * below + 2.0 * t * density) / n
    # the next order is mu^2 = t^2 / n and some 1 / n
    assert albedo.highlight(t / math.sqrt(n), n) == pytest.approx(expected, rel=20.0 / n)


@pytest.mark.render
@pytest.mark.parametrize("exponent", [0.0, 0.5, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, 10000.0])
def test_albedo_of_the_highlight_is_within_its_error(exponent: float) -> None:
    spread = min(1.0, 6.0 / math.sqrt(exponent + 1.0))
    mus = [spread * (i + 0.5) / 40 for i in range(40)] + [0.0, 0.2, 0.6, 0.95, 1.0]
    got = values("directional_albedo", "blinn_phong_albedo(a.x, vec3(0.25), 0.5, a.y)", [((mu, exponent),) for mu in mus])
    for mu, value in zip(mus, got, strict=True):
        exact = exponent == 0.0 or mu in (0.0, 1.0)
        expected = albedo.highlight(mu, exponent) if exponent > 0.0 else 1.0
        # the quadrature is off by up to 4e-5
        assert (value - 0.25) / 0.5 == pytest.approx(expected, rel=5e-5 if exact else 0.032, abs=ROUND), mu


@pytest.mark.render
def test_albedo_of_the_highlight_is_finite_for_anything() -> None:
    rows = [(case,) for case in itertools.product(HARD, HARD, HARD)]
    assert all(0.0 <= value < 1.3 for value in values("directional_albedo", "blinn_phong_albedo(a.x, vec3(0.0), a.y, a.z)", rows))


def numbers_in(stem: str, line: str) -> list[float]:
    """Return the decimal numbers of a line of a shader from `line` on."""
    text = (SHADERS / f"{stem}.glsl").read_text()
    (found,) = (rest for rest in text.splitlines() if line in rest)
    return [float(number) for number in re.findall(r"(?<![\w.])\d+\.\d+", found.split(line)[1])]


def test_shaders_have_the_numbers_of_the_fit() -> None:
    facets, mirrored = albedo.fit_facets(), albedo.fit_mirrored()
    # written with 5 digits; signs are the shader's own operators
    one = numbers_in("directional_albedo", "float f = (1.0 - m) * (")
    assert one == pytest.approx([abs(number) for number in facets.numbers], rel=1e-4)
    kept = numbers_in("coat", "return 1.0 - near * (")
    assert kept == pytest.approx([abs(number) for number in mirrored.numbers], rel=1e-4)
    assert numbers_in("coat", "float near = ") == [albedo.NEAR, albedo.SQUARE, -albedo.PRODUCT]
    assert numbers_in("directional_albedo", "float below = ") == [1.0, 2.0, pytest.approx(0.5 * math.log(2.0)), 1.0, *albedo.BELOW]


# ---- coat.glsl


def ggx(l: Vector, v: Vector, alpha: float) -> float:
    """Return D G2 / (4 N.V) for N upwards, as the papers print it: by tangents, and Smith's Lambda."""

    def smith(mu: float) -> float:
        tangent2 = 1.0 / mu**2 - 1.0
        return 0.5 * (math.sqrt(1.0 + alpha**2 * tangent2) - 1.0)

    z = normalize(add(l, v))[2]
    d = 1.0 / (math.pi * alpha**2 * z**4 * (1.0 + (1.0 / z**2 - 1.0) / alpha**2) ** 2)
    return d / (1.0 + smith(l[2]) + smith(v[2])) / (4.0 * v[2])


@pytest.mark.render
@pytest.mark.parametrize("ior", [0.5, 1.0, 1.4, 3.0, math.nan])
def test_coat_fresnel_is_its_model(ior: float) -> None:
    cases = list(itertools.product((0.0, *MUS), (0.0, 0.2, 0.5, 1.0)))
    got = values("coat", "coat_fresnel(a.x, a.y, a.z)", [((*case, ior),) for case in cases])
    for (mu, roughness), value in zip(cases, got, strict=True):
        assert value == pytest.approx(mean_fresnel(mu, roughness, ior), abs=ROUND), (mu, roughness)


SINGLE = "coat_highlight(coat_surface(a.xyz, c.xyz, a.w), b.xyz) * coat_single_albedo(dot(a.xyz, c.xyz), coat_alpha(a.w))"


@pytest.mark.render
@pytest.mark.parametrize("roughness", [0.1, 0.3, 0.5, 1.0])
def test_coat_single_scattering_is_ggx(roughness: float) -> None:
    dice = random.Random(2)
    pairs = [(from_polar(dice.random(), dice.uniform(0.0, 7.0)), from_polar(dice.random(), 0.0)) for _ in range(500)]
    pairs += [(from_polar(mu, math.pi + 0.05 * k), from_polar(mu, 0.0)) for mu in MUS[1:] for k in range(5)]  # where it shines
    got = values("coat", SINGLE, [((*UP, roughness), l, v) for l, v in pairs])
    alpha = roughness**2
    # N x H is off by 32 bits' last places, 2e-7, and D goes by (sin / alpha)^4 at the most; and coat_alpha rounds
    for (l, v), value in zip(pairs, got, strict=True):
        assert value == pytest.approx(ggx(l, v, alpha), rel=4.0 * 2e-7 / alpha + 5e-6), (l, v)


@pytest.mark.render
def test_coat_single_scattering_is_reciprocal() -> None:
    dice = random.Random(4)
    rows = []
    for _ in range(500):
        n, l, v = (normalize((dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0))) for _ in range(3))
        l, v = (x if dot(n, x) > 0.0 else (-x[0], -x[1], -x[2]) for x in (l, v))
        rows.append(((*n, dice.uniform(0.2, 1.0)), l, v))
    there, back = (values("coat", SINGLE, some) for some in (rows, [(n, v, l) for n, l, v in rows]))
    for (n, l, v), one, other in zip(rows, there, back, strict=True):
        if min(dot(n[:3], l), dot(n[:3], v)) > 0.01:  # a plain dot() is off by 1e-7, so by 1e-5 of the cosines here
            assert one / dot(n[:3], l) == pytest.approx(other / dot(n[:3], v), rel=1e-4)


@pytest.mark.parametrize("mu", MUS)
def test_quadrature_of_the_coat_at_alpha_1(mu: float) -> None:
    # D is 1 / pi and G2 2 (N.L)(N.V) / (N.L + N.V), so E is the integral of x / (x + mu) over x in [0, 1]
    assert albedo.mirrored(mu, 1.0) == pytest.approx(1.0 - mu * math.log1p(1.0 / mu), abs=1e-4)


@pytest.mark.parametrize(("mu", "alpha"), list(itertools.product((0.1, 0.5, 0.9), (0.2, 0.5))))
def test_quadrature_of_the_coat_equals_that_over_lights(mu: float, alpha: float) -> None:
    class Mirror:
        def radiance(self, _n: Vector, l: Vector, v: Vector, _albedo: float) -> float:
            return ggx(l, v, alpha)

    assert albedo.mirrored(mu, alpha) == pytest.approx(directional_albedo(Mirror(), mu, 1.0, 96), abs=1e-4)


@pytest.mark.render
def test_coat_single_albedo_is_within_its_error() -> None:
    cases = [(mu, (i / 25) ** 2) for mu in (0.003, 0.03, 0.07, *(k / 15 for k in range(2, 16))) for i in range(1, 26)]
    for (mu, alpha), value in zip(cases, values("coat", "coat_single_albedo(a.x, a.y)", [(case,) for case in cases]), strict=True):
        assert value == pytest.approx(albedo.mirrored(mu, alpha), rel=0.016), (mu, alpha)


@pytest.mark.render
@pytest.mark.parametrize(("mu", "roughness"), list(itertools.product((0.1, 0.5, 0.9), (0.45, 0.7, 1.0))))
def test_coat_reflects_all_of_a_white_sky(mu: float, roughness: float) -> None:
    order, rows, weights = 64, [], []
    breaks = (0.0, math.acos(mu), 0.5 * math.pi)
    for low, high in itertools.pairwise(breaks):
        for (x, w), (y, u) in itertools.product(gauss_legendre(order), repeat=2):
            angle = 0.5 * (low + high) + 0.5 * (high - low) * x
            rows.append(((*UP, roughness), from_polar(math.cos(angle), 0.5 * math.pi * (1.0 + y)), from_polar(mu, 0.0)))
            weights.append(w * 0.5 * (high - low) * math.sin(angle) * u * math.pi)
    got = values("coat", "coat_highlight(coat_surface(a.xyz, c.xyz, a.w), b.xyz)", rows)
    assert math.sumprod(got, weights) == pytest.approx(1.0, abs=0.016)


@pytest.mark.render
def test_coat_is_finite_for_anything() -> None:
    rows = [(case,) for case in itertools.product(HARD, HARD, HARD)]
    assert all(0.0 <= value <= 1.0 for value in values("coat", "coat_fresnel(a.x, a.y, a.z)", rows))
    dice = random.Random(6)

    def size() -> float:
        return dice.choice(HARD) if dice.random() < 0.1 else dice.choice((-1.0, 1.0)) * 10.0 ** dice.uniform(-20.0, 8.5)

    rows = [((size(), size(), abs(size()), size()), (size(), size(), size()), (size(), size(), size())) for _ in range(20000)]
    rows += [((*UP, size()), (size(), size(), abs(size())), (size(), size(), abs(size()))) for _ in range(20000)]
    # opposite each other along the horizon, in line, and with nothing left of H
    rows += [((*UP, r), (1.0, 0.0, low), (-1.0, 0.0, low)) for r in HARD for low in (1e-17, 1e-9, 1e-3)]
    rows += [((*UP, r), UP, UP) for r in HARD]
    got = values("coat", "coat_highlight(coat_surface(a.xyz, c.xyz, a.w), b.xyz)", rows)
    assert all(0.0 <= value < math.inf for value in got)
    assert sum(value > 0.0 for value in got) > 1000


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
@pytest.mark.parametrize("roughness", [0.3, 0.6, 1.0])
def test_coat_is_that_of_cycles(roughness: float) -> None:
    sphere = sphere_under_sun(48)
    material = bpy.data.materials.new("Glossy")
    nodes = material.node_tree.nodes
    nodes.clear()
    glossy, output = nodes.new("ShaderNodeBsdfAnisotropic"), nodes.new("ShaderNodeOutputMaterial")
    glossy.distribution = "MULTI_GGX"
    glossy.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    glossy.inputs["Roughness"].default_value = roughness
    material.node_tree.links.new(glossy.outputs[0], output.inputs["Surface"])
    sphere.sun.rotation_euler = (math.radians(60.0), 0.0, math.radians(40.0))
    bpy.context.view_layer.update()
    surface, light = sphere.surface(), render.light_of(sphere.sun)
    _, rgb = sphere.radiance(material, [sphere.sun], None, engines.CYCLES, 1)
    eye = tuple(sphere.scene.camera.matrix_world.translation)
    pixels, rows = [], []
    for pixel, good in enumerate(surface.measurable):
        n, p = (tuple(channel[3 * pixel : 3 * pixel + 3]) for channel in (surface.normal, surface.position))
        v = normalize(add(eye, (-p[0], -p[1], -p[2])))
        if good and min(dot(n, v), dot(n, light.direction)) > 0.05:
            pixels.append(pixel)
            rows.append(((*n, roughness), light.direction, v))
    assert len(pixels) > 300
    got = values("coat", "coat_highlight(coat_surface(a.xyz, c.xyz, a.w), b.xyz)", rows)
    for pixel, value in zip(pixels, got, strict=True):
        # the error that coat_single_albedo states; Cycles has a table in its place
        assert value * light.irradiance == pytest.approx(rgb[3 * pixel], rel=0.02)


# ---- burley.glsl

D = 2.5


@pytest.mark.render
def test_burley_profile_is_its_model() -> None:
    radii = [10.0**k for k in range(-9, 3)] + [0.3, 3.0, 30.0]
    got = evaluate("burley", "burley_profile(a.x, vec3(a.y, 1.0, 0.25))", [((r, D),) for r in radii])
    for r, value in zip(radii, got, strict=True):
        # e^(-x) in 32 bits is off by x 6e-8 and what exp() adds
        assert value == pytest.approx([Burley(d).profile(r) for d in (D, 1.0, 0.25)], rel=2e-5, abs=1e-37)


@pytest.mark.render
def test_burley_profile_integrates_to_1() -> None:
    breaks, rows, weights = (0.0, 1.0, 4.0, 12.0, 40.0), [], []  # of what is farther e^(-40 / 3) is left
    for (low, high), (x, w) in itertools.product(itertools.pairwise(breaks), gauss_legendre(24)):
        r = D * (0.5 * (low + high) + 0.5 * (high - low) * x)
        rows.append(((r, D),))
        weights.append(2.0 * math.pi * r * D * 0.5 * (high - low) * w)
    assert math.sumprod(values("burley", "burley_density(a.x, a.y)", rows), weights) == pytest.approx(1.0, abs=1e-5)


@pytest.mark.render
def test_burley_radius_holds_the_fraction_asked_for() -> None:
    fractions = [10.0**-k for k in range(1, 30)] + [i / 100 for i in range(1, 100)] + [1.0 - 2.0**-k for k in range(4, 25)]
    got = values("burley", "burley_radius(a.x, a.y)", [((fraction, D),) for fraction in fractions])
    for fraction, r in zip(fractions, got, strict=True):
        if fraction < 0.5:
            assert Burley(D).cdf(r) == pytest.approx(fraction, rel=2e-6, abs=0.0)
        else:  # 1 - cdf
            x = r / D
            assert 0.25 * math.exp(-x) + 0.75 * math.exp(-x / 3.0) == pytest.approx(1.0 - fraction, rel=3e-5, abs=0.0)
    assert got[:29] == sorted(got[:29], reverse=True)


@pytest.mark.render
def test_burley_samples_have_the_density_it_says() -> None:
    # the fraction between two radii over the area of the ring
    cases = [0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.99]
    step = 2.0**-9
    low, high = (values("burley", "burley_radius(a.x, a.y)", [((xi + sign * step, D),) for xi in cases]) for sign in (-0.5, 0.5))
    middle = values("burley", "burley_density(burley_radius(a.x, a.y), a.y)", [((xi, D),) for xi in cases])
    for inner, outer, density in zip(low, high, middle, strict=True):
        ring = math.pi * (outer - inner) * (outer + inner)
        # r follows log(1 - xi), whose second difference over its first is (step / (1 - xi))^2 / 12, 1 / 300 for the last
        assert step / ring == pytest.approx(density, rel=0.01)


@pytest.mark.render
def test_burley_d_gives_the_edge_width_of_the_medium() -> None:
    cases = list(itertools.product((0.0, 0.1, 0.5, 0.9, 1.0), (1e-3, 0.7, 20.0)))
    got = evaluate("burley", "burley_d(vec3(a.x, 0.3, 0.6), vec3(a.y, 1.0, 2.0))", [(case,) for case in cases])
    for (color, path), value in zip(cases, got, strict=True):
        expected = [length * edge_width(c) / EDGE_WIDTH_25_75 for c, length in ((color, path), (0.3, 1.0), (0.6, 2.0))]
        assert value == pytest.approx(expected, rel=1e-6)
        # a shadow's edge on Burley's profile passes 75 % half a width from the middle
        assert Burley(value[0]).edge(0.5 * path * edge_width(color)) == pytest.approx(0.75, abs=1e-6)


@pytest.mark.render
def test_burley_is_finite_for_anything() -> None:
    rows = [(case,) for case in itertools.product(HARD, HARD)]
    density, radius = (values("burley", f"burley_{name}(a.x, a.y)", rows) for name in ("density", "radius"))
    width = values("burley", "burley_d(vec3(a.x), vec3(a.y)).x", rows)
    assert all(0.0 <= value < math.inf for value in density)
    assert all(0.0 <= value < 50.0 * 1.001e9 for value in radius)
    assert all(0.99e-9 < value < 1.01e9 for value in width)
    at_zero = values("burley", "burley_density(a.x, 1.0)", [((r,),) for r in (math.nan, -1.0, 0.0, 1e-9)])
    assert len(set(at_zero)) == 1 and at_zero[0] == pytest.approx(2.0 / (8.0 * math.pi * 1e-9), rel=1e-5)
