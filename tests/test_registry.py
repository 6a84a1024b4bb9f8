# SPDX-License-Identifier: GPL-3.0-or-later
"""The registry of reflectance models: what holds for each of them, what a new one takes, and that an unknown one is refused."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import bpy

import pytest

from support import EXTREME, USUAL, every_model
from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.glsl import source
from true_diffuse.addon.closures.lobe import PAIR
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.gltf.diffuse import Diffuse
from true_diffuse.addon.gltf.stand_in import Replaced
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.expression import Constant
from true_diffuse.addon.material.read import group_node
from true_diffuse.addon.material.summary import material_summary, stated_error
from true_diffuse.addon.material.surface import Surface
from true_diffuse.addon.models import (
    MODELS,
    Fujii,
    ReflectanceModel,
    average_albedo,
    by_formula,
    by_label,
    by_number,
    directional_albedo,
    register,
    unregister,
)
from true_diffuse.addon.models.geometry import Geometry, clamp
from true_diffuse.addon.models.protocol import Formula
from true_diffuse.addon.models.quadrature import NORMAL, gauss_legendre, integrate
from true_diffuse.addon.models.registry import ROUGHNESS, SMOOTH, Glsl, MaterialX
from true_diffuse.addon.models.terms import Expansion, Light, Number, SingleLightTerms, Terms, float_view, relative_radiance
from true_diffuse.addon.models.vector import Vector, from_polar
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, chosen_lights
from true_diffuse.addon.nodes.rough_diffuse import ROUGH
from true_diffuse.addon.realtime import program
from true_diffuse.addon.realtime.materials import surface_material
from true_diffuse.addon.realtime.models import glsl_model
from true_diffuse.addon.usd.nearest import Nearest
from true_diffuse.scenes.sphere import COLOR, sphere_under_sun
from true_diffuse.scripts.studies import glsl_values, osl_values, reference_mpmath, stability_glsl

pytestmark = pytest.mark.usefixtures("empty_file")

# ---- What every model states about itself


def models(*, single_light: bool = False, rough: bool = False, parameter: bool = False):
    """Parametrize with the registered models that have all that is asked for."""
    chosen = {
        key: model
        for key, model in MODELS.items()
        if model.has_single_light >= single_light and model.is_rough >= rough and (model.parameter is not None) >= parameter
    }
    return pytest.mark.parametrize("model", chosen.values(), ids=chosen)


def terms(model: ReflectanceModel, inputs: dict[str, float], mu: float, rho: float) -> Terms:
    return model.terms_of(model.reference(inputs), float_view(mu, rho))


@every_model
@pytest.mark.parametrize("inputs", [USUAL, EXTREME], ids=["usual", "extreme"])
def test_average_albedo_is_that_of_the_formula(model: ReflectanceModel, inputs: dict[str, float]) -> None:
    formula = model.reference(inputs)
    for rho in (0.3, 1.0):
        # 12 points leave 1e-4 where the formula has creases or is cut off at 0
        assert formula.average_albedo(rho) == pytest.approx(average_albedo(formula, rho, order=24), abs=3e-4)


@every_model
@pytest.mark.parametrize("inputs", [USUAL, EXTREME], ids=["usual", "extreme"])
@pytest.mark.parametrize("mu", [1.0, 0.6, 0.1])
def test_expansion_keeps_the_energy(model: ReflectanceModel, inputs: dict[str, float], mu: float) -> None:
    """The mean over all lights that stands in where a factor depends on the light leaves the directional albedo as it is."""
    rho = 0.7
    facing, weights = terms(model, inputs, mu, rho).expansion()
    assert list(weights) == [function.name for function in model.functions] and all(weight >= 0.0 for weight in weights.values())

    def ring(elevation: float) -> float:
        def value(azimuth: float) -> float:
            l = from_polar(math.cos(elevation), azimuth)
            return facing * l[2] + sum(weights[function.name] * function.value(l, mu) for function in model.functions)

        return 2.0 / math.pi * math.sin(elevation) * integrate(value, (0.0, 0.5 * math.pi, math.pi), 24)

    expanded = integrate(ring, (0.0, math.acos(mu), 0.5 * math.pi), 24)
    # Wolff's mean is a fit to 0.2 %; at sigma = 1 the 1994 model's functions leave out that it is cut off at 0, 0.4 % of it
    assert expanded == pytest.approx(directional_albedo(model.reference(inputs), mu, rho) / rho, abs=0.005)


@pytest.mark.parametrize("key", [key for key in MODELS if key not in ("eon", "cycles_diffuse", "wolff")])
@pytest.mark.parametrize("rho", [0.2, 1.0])
def test_expansion_is_the_formula_where_no_factor_depends_on_the_light(key: str, rho: float) -> None:
    model = MODELS[key]
    for mu, (x, _) in ((mu, node) for mu in (0.9, 0.3) for node in gauss_legendre(7)):
        l = from_polar(0.5 + 0.5 * x, 2.0 + x)
        facing, weights = terms(model, USUAL, mu, rho).expansion()
        value = facing * l[2] + sum(weights[function.name] * function.value(l, mu) for function in model.functions)
        # functions are differences of radiances, of some 1e-16, divided by weights down to 0.1
        assert value == pytest.approx(relative_radiance(model.reference(USUAL), l, mu, rho), abs=1e-13)


@models(single_light=True)
@pytest.mark.parametrize("inputs", [USUAL, EXTREME], ids=["usual", "extreme"])
def test_single_light_form_is_the_formula(model: ReflectanceModel, inputs: dict[str, float]) -> None:
    for mu, (x, _) in ((mu, node) for mu in (1.0, 0.9, 0.3, 0.01) for node in gauss_legendre(7)):
        l, rho = from_polar(0.5 + 0.5 * x, 2.0 + x), 0.7
        own = terms(model, inputs, mu, rho)
        assert isinstance(own, SingleLightTerms)
        light = Light(own.view, l[2], from_polar(mu, 0.0)[0] * l[0])
        expected = relative_radiance(model.reference(inputs), l, mu, rho)
        # acos and square roots of differences near V = N, where the node's own 1e-6 guards count too
        assert own.single_light(light) * l[2] == pytest.approx(expected, rel=1e-9, abs=1e-12)


@models(single_light=True)
@pytest.mark.parametrize("mu", [1.0, 0.6, 0.1])
def test_directional_albedo_in_nodes_is_that_of_the_formula(model: ReflectanceModel, mu: float) -> None:
    own = terms(model, USUAL, mu, 0.7)
    assert isinstance(own, SingleLightTerms)
    expected = directional_albedo(model.reference(USUAL), mu, 0.7) / 0.7
    # fits: 0.0011 of the 1994 model's, 0.002 of Wolff's
    assert own.directional_albedo() == pytest.approx(expected, abs=0.002)


@models(parameter=True)
def test_parameter_counts_as_the_nearest_in_range(model: ReflectanceModel) -> None:
    parameter = model.parameter
    assert parameter
    for value, counts_as in ((-math.inf, parameter.low), (math.nan, parameter.low), (parameter.low - 1.0, parameter.low)):
        assert model.formula(value) == model.formula(counts_as)
        at = float_view(0.5, 0.7)
        assert model.terms_of(model.formula(value), at).value == counts_as
    assert model.terms_of(model.formula(math.inf), float_view(0.5, 0.7)).value == parameter.high


@models(rough=True)
def test_rough_model_at_zero_is_lambert(model: ReflectanceModel) -> None:
    facing, weights = terms(model, {"Roughness": 0.0}, 0.4, 0.7).expansion()
    assert facing == 1.0 and set(weights.values()) == {0.0}


@models(parameter=True)
def test_glsl_coefficients_are_the_constants_of_the_formula(model: ReflectanceModel, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    constants = model.reference(USUAL).constants
    padding = ", 0.0" * (3 - len(constants))
    (got,) = glsl_values.evaluate(model.id, f"vec3({model.id}_coefficients(a.x){padding})", [(model.shape(USUAL),)])
    assert got[: len(constants)] == pytest.approx(constants, rel=1e-6)


def test_every_model_has_a_formula_of_its_own_to_be_judged_by() -> None:
    assert set(reference_mpmath.MODELS) == set(MODELS)


def test_models_are_told_apart() -> None:
    assert [model.number for model in MODELS.values()] == list(range(len(MODELS)))
    for model in MODELS.values():
        assert by_label(model.label) is by_number(model.number) is by_formula(model.reference(USUAL)) is MODELS[model.id] is model


# ---- Adding a model: addon/README.md


@dataclass(frozen=True)
class Minnaert(Formula):
    """M. Minnaert (1941), for the moon: L_r = (rho / pi) E0 (N.L)^k (N.V)^(k - 1); `roughness` is k - 1, clamped to [0, 1]."""

    roughness: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "roughness", clamp(self.roughness, 0.0, 1.0))

    def reflected(self, g: Geometry, rho: float) -> float:
        return rho / math.pi * g.mu_i * (g.mu_i * g.mu_o) ** self.roughness

    def average_albedo(self, albedo: float) -> float:
        return albedo * (2.0 / (2.0 + self.roughness)) ** 2

    @property
    def constants(self) -> tuple[float, ...]:
        return (self.roughness,)


class MinnaertTerms(SingleLightTerms):
    """z (N.V)^(k - 1) and the mean over all lights of (N.L)^(k - 1): no lobes."""

    def expansion(self) -> Expansion:
        return Expansion(self.directional_albedo(), {})

    def single_light(self, light: Light) -> Number:
        return (light.mu * self.view.mu) ** self.value

    def directional_albedo(self) -> Number:
        return self.view.mu**self.value * (2.0 / (2.0 + self.value))


MINNAERT_GLSL = """
// Include geometry.glsl before it.
struct MinnaertSurface { DiffuseView view; vec3 color; float power; };
float minnaert_coefficients(float roughness) { return diffuse_range(roughness, 1.0); }
MinnaertSurface minnaert_surface(vec3 n, vec3 v, vec3 albedo, float power)
{
    return MinnaertSurface(diffuse_view(n, v), diffuse_albedo(albedo) / 3.14159265358979, power);
}
vec3 minnaert_radiance(MinnaertSurface surface, vec3 l)
{
    float mu_i = diffuse_geometry(surface.view, l).mu_i;
    return surface.color * (mu_i * pow(mu_i * surface.view.mu_o, surface.power));
}
vec3 minnaert_albedo(float mu, vec3 albedo, float power)
{
    return diffuse_albedo(albedo) * pow(diffuse_range(mu, 1.0), power) * (2.0 / (2.0 + power));
}
"""


@pytest.fixture
def minnaert(tmp_path: Path) -> Iterator[ReflectanceModel]:
    """The ninth model, registered while a test runs; its GLSL file lies elsewhere, as nothing of the project is touched."""
    (tmp_path / "minnaert.glsl").write_text(MINNAERT_GLSL)
    model = ReflectanceModel(
        id="minnaert",
        number=8,
        label="Minnaert",
        description="Minnaert's law of the moon",
        formula=Minnaert,
        terms=MinnaertTerms,
        parameter=ROUGHNESS,
        glsl=Glsl(albedo_stem="", folder=tmp_path),
        materialx=MaterialX("lambert", roughness=0.0),
        eon=SMOOTH,
    )
    register(model)
    yield model
    unregister(model)
    assert "minnaert" not in MODELS


def clay(**inputs: object) -> bpy.types.Material:
    return materials.create("Moon", ROUGH_DIFFUSE, Model="Minnaert", Color=COLOR, Roughness=0.5, **inputs)


def test_new_model_is_in_the_menu_with_its_description(minnaert: ReflectanceModel) -> None:
    switches = [node for node in ROUGH.ensure().nodes if node.bl_idname == "GeometryNodeMenuSwitch"]
    entries = next({item.name: item.description for item in node.enum_items} for node in switches if len(node.enum_items) == 9)
    assert list(entries)[-1] == "Minnaert" and entries["Minnaert"] == minnaert.description
    assert bpy.data.node_groups[".True Diffuse Minnaert"].nodes


def test_new_model_has_closures_by_its_expansion(minnaert: ReflectanceModel) -> None:
    formula = minnaert.reference(USUAL)
    l, v = from_polar(0.8, 1.0), from_polar(0.3, 0.0)
    expected = 0.7 / math.pi * 0.8 * 0.3**0.5 * (2.0 / 2.5)
    assert Rendered(formula, PAIR).radiance(NORMAL, l, v, 0.7) == pytest.approx(expected, rel=1e-12)


@pytest.mark.render
def test_new_model_renders(minnaert: ReflectanceModel) -> None:

    sphere = sphere_under_sun(64)
    chosen_lights.choose([sphere.sun])
    formula = minnaert.reference(USUAL)
    lobes, exact = (clay(Quality=quality) for quality in ("Balanced", "Exact for Chosen Lights"))
    (errors,) = sphere.measure(lobes, [Rendered(formula, PAIR)], engines.CYCLES, 4, 60.0)[1]
    assert errors.rms < 0.002  # Cycles' pixel filter, as in test_nodes.py
    (errors,) = sphere.measure(exact, [formula], engines.CYCLES, 4, 60.0)[1]
    assert errors.rms < 0.002
    sphere.scene.cycles.shading_system = True  # the OSL shader lacks it: the closures stay
    (errors,) = sphere.measure(lobes, [Rendered(formula, PAIR)], engines.CYCLES, 4, 60.0)[1]
    assert errors.rms < 0.002


def test_new_model_is_in_glsl(minnaert: ReflectanceModel, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    l, v = from_polar(0.8, 1.0), from_polar(0.3, 0.0)
    shader = stability_glsl.shader_of(minnaert)
    rows = [stability_glsl.Inputs(NORMAL, l, v, 0.7, minnaert.shape(USUAL)).row()]
    (got,) = glsl_values.evaluate(minnaert.id, shader.call(), rows)
    assert got[0] == pytest.approx(minnaert.reference(USUAL).radiance(NORMAL, l, v, 0.7), rel=1e-6)  # 32-bit floats


def test_new_model_is_said_to_be_lacking_in_osl(minnaert: ReflectanceModel) -> None:
    assert minnaert.osl is None and minnaert.id not in osl_values.drawn()
    assert len(osl_values.drawn()) == len(MODELS) - 1


def test_new_model_is_in_the_realtime_engine(minnaert: ReflectanceModel) -> None:
    made = surface_material(Surface(minnaert.id, {"diffuse_roughness": Constant(USUAL["Roughness"])}), 1.0)
    assert 0.5 in made.code.values
    lighting = program.Lighting(frozenset(("SUN",)), False, True)
    variant = program.Variant(made.model, program.Inputs.of(made.code), made.features, False, lighting)
    text = program.surface_program(variant).fragment
    assert "#define SURFACE MinnaertSurface surface = minnaert_surface(n, v, albedo, inputs.shape);" in text
    assert "#define ALBEDO(mu) minnaert_albedo(mu, albedo, inputs.shape)" in text
    assert source("geometry") in text and MINNAERT_GLSL in text and "oren_nayar_albedo" not in text


@pytest.mark.usefixtures("minnaert")
def test_new_model_has_a_nearest_closure_in_usd() -> None:
    nearest = Nearest("Minnaert", USUAL)
    assert nearest.stands_in == "Lambert of equal average albedo"
    assert (nearest.compensated, nearest.roughness) == (False, 0.0)
    assert nearest.color(0.6) == pytest.approx(0.6 * 0.64, rel=1e-12)  # (2 / 2.5)^2


@pytest.mark.usefixtures("minnaert")
def test_new_model_has_the_nearest_eon_in_gltf() -> None:
    node = group_node(clay())[0]
    diffuse = Diffuse(Replaced(node, node, ()))
    assert diffuse.roughness == 0.0 and diffuse.color(0.6) == pytest.approx(0.6 * 0.64, rel=1e-12)  # as in USD


def test_panel_states_the_error_of_the_new_model(minnaert: ReflectanceModel) -> None:
    bpy.context.scene.render.engine = engines.CYCLES.identifier
    summary = material_summary(clay())
    assert summary and summary.reflectance is minnaert
    words = stated_error(summary, bpy.context.scene)
    # RMS over the hemisphere of mu_i (mu_i^k - 2 / (2 + k)) over mu_i mu_i^k, k = 1/2, integrated by hand: the same at every view
    k = 0.5
    mean = 2.0 / (2.0 + k)
    expected = math.sqrt(1.0 - 2.0 * mean * (3.0 + 2.0 * k) / (3.0 + k) + mean**2 * (3.0 + 2.0 * k) / 3.0)
    assert f"{100.0 * expected:.2g} %" in words and "Minnaert" in words
    chosen = clay(Quality="Exact for Chosen Lights")
    chosen_lights.choose([bpy.data.objects.new("Sun", bpy.data.lights.new("Sun", "SUN"))])
    assert stated_error(material_summary(chosen), bpy.context.scene).startswith("Exact for the chosen")


def test_model_is_not_registered_twice(minnaert: ReflectanceModel) -> None:
    with pytest.raises(ValueError, match="clashes with Minnaert"):
        register(minnaert)


# ---- A model that nobody knows


class Unknown:
    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        return 0.0


UNKNOWN = {
    "id": lambda: MODELS["phong"],
    "label": lambda: by_label("Phong"),
    "number": lambda: by_number(99),
    "lobes": lambda: Rendered(Unknown(), PAIR).radiance(NORMAL, NORMAL, NORMAL, 1.0),
    "glsl": lambda: source("phong"),
    "realtime": lambda: glsl_model(by_label("Phong")),
    "usd": lambda: Nearest("Phong", USUAL),
    "gltf": lambda: Surface("phong").reflectance,
    "referee": lambda: reference_mpmath.radiance("phong", NORMAL, NORMAL, NORMAL, 1.0),
}


@pytest.mark.parametrize("ask", UNKNOWN.values(), ids=UNKNOWN)
def test_unknown_model_raises(ask) -> None:
    with pytest.raises((KeyError, ValueError, FileNotFoundError), match=r"(?i)phong|99|Unknown"):
        ask()


def test_unknown_model_is_refused_by_the_node_group() -> None:
    with pytest.raises(TypeError, match="Phong"):
        materials.create("Phong", ROUGH_DIFFUSE, Model="Phong")


@pytest.mark.render
def test_unknown_model_is_magenta_in_osl() -> None:
    sphere = sphere_under_sun(16)
    sphere.scene.cycles.shading_system = True
    unknown = osl_values.create_osl("Unknown", "rough_diffuse", Model=len(MODELS), Color=COLOR)
    lambert = osl_values.create_osl("White", "rough_diffuse", Model=MODELS["lambert"].number, Color=(1.0,) * 4)
    magenta, white = (sphere.radiance(material, [sphere.sun], None, engines.CYCLES, 4)[1] for material in (unknown, lambert))
    assert max(magenta[1::3]) == 0.0 < max(magenta[0::3])
    assert list(magenta[0::3]) == list(magenta[2::3]) == pytest.approx(list(white[0::3]), rel=1e-6)


def test_unregistered_formula_of_a_subclass_is_unknown() -> None:
    class Mine(Fujii):
        pass

    with pytest.raises(ValueError, match="Mine"):
        by_formula(Mine(0.5))
