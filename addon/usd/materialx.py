# SPDX-License-Identifier: GPL-3.0-or-later
"""A `Surface` as a network of MaterialX 1.39's physically based shading nodes.

    surface               opacity, emission
    fuzz                  sheen_bsdf, Zeltner's as in Cycles
    coat                  dielectric_bsdf, over what is below times the coat's color
    highlight             generalized_schlick_bsdf, added
    metal                 generalized_schlick_bsdf with F82's tint, mixed by Metallic with
    specular              dielectric_bsdf or, tinted, generalized_schlick_bsdf, over a mix of
    transmission          dielectric_bsdf, and a mix of
    subsurface            subsurface_bsdf, and
    diffuse               oren_nayar_diffuse_bsdf

What a surface lacks is not there. OpenPBR's surface would say the same of the layers in one node, and readers such as Hydra Storm
make of it the nodes above; but its diffuse reflection is EON alone, where oren_nayar_diffuse_bsdf has Lambert, equation (1) and EON
exactly.

The highlight of Standard Specular is that of the node group: GGX with alpha^2 = 2 / (n + 2), of height (n + 8) / (n + 2) k_s, times
V.H, which generalized_schlick_bsdf has with exponent 1 from color0 to black: V.H is mu at the mirror direction.
"""

from collections.abc import Callable, Mapping
from math import tau

from ..material.expression import Apply, Attribute, Bump, Coordinate, Expression, ImageTexture, apply, walk
from ..material.expression import Constant as Value
from ..material.surface import PARAMETERS, Loss, Surface, texture_factor
from ..models.geometry import clamp
from .expressions import Writer, pair
from .files import Files, Unsupported
from .nearest import Nearest
from .network import BOOL, COLOR, FLOAT, STRING, TOKEN, VECTOR2, Constant, Input, Network, Output
from .terms import Term

VERSION = "1.39"
OWN_VALUE = "the socket's own value is written"
# Operations whose value is within [0, 1] where their arguments are, or always
BOUNDED = {"x", "y", "z", "luminance", "average", "combine", "multiply", "mix", "minimum", "maximum"}
SWITCHES = {"less_than", "greater_than", "compare", "fraction", "smooth_step", "smoother_step"}
MAX_REFLECTANCE = 0.99  # at normal incidence of a dielectric
ANISOTROPY = 0.9  # the squares' ratio of the axes of Cycles' lobes at Anisotropic 1 is 1 minus that


def network(surface: Surface, files: Files, millimeter: float, own: Mapping[str, Expression]) -> tuple[Network, list[Loss]]:
    """Return the network of `surface`, and what it lacks.

    `millimeter` is a millimeter in the stage's units. `own` has the sockets' own values, which stand for what MaterialX lacks.
    """
    builder = _Builder(surface, files, own)
    builder.build(millimeter)
    return builder.network, builder.losses


class _Builder:
    def __init__(self, surface: Surface, files: Files, own: Mapping[str, Expression]) -> None:
        self.surface, self.own = surface, own
        self.network = Network("MaterialX_")
        self.writer = Writer(self.network, files, surface.inputs.values())
        self.losses: list[Loss] = []
        self._alphas: dict[str, Input] = {}

    def build(self, millimeter: float) -> None:
        surface, add = self.surface, self._add
        bsdf = self._base(millimeter)
        if surface.uses("highlight_weight"):
            bsdf = add("sum", "ND_add_bsdf", in1=bsdf, in2=self._highlight())
        emission = self._emission()
        if surface.uses("coat_weight"):
            bsdf = self._coated(bsdf)
        if surface.uses("fuzz_weight"):
            fuzz = add(
                "fuzz",
                "ND_sheen_bsdf",
                weight=self._unit("fuzz_weight"),
                color=self._value("fuzz_color", lambda one: self.writer.color(unit(one))),
                roughness=self._unit("fuzz_roughness"),
                mode=Constant(STRING, "zeltner"),
                **self._normal("normal"),
            )
            bsdf = add("fuzzy", "ND_layer_bsdf", top=fuzz, base=bsdf)
        rest: dict[str, Input] = {"edf": emission} if emission else {}
        if surface.uses("opacity"):
            rest["opacity"] = self._unit("opacity")
        if surface.is_thin_wall:
            rest["thin_walled"] = Constant(BOOL, True)
        add("surface", "ND_surface", bsdf=bsdf, **rest)
        if any(isinstance(one, Bump) for value in surface.inputs.values() for one in walk(value)):
            self.losses.append(Loss("", "", "a bump by lengths in MaterialX", "its height is over the UV map's unit there"))
        if not surface.is_multi_scattering and {"metallic", "specular_weight", "transmission_weight"} & set(surface.inputs):
            what = "a specular lobe without multiple scattering (Distribution GGX)"
            self.losses.append(Loss("", "", what, "one with it is written"))

    # closures

    def _base(self, millimeter: float) -> Output:
        """Return metal, glass, and specular over subsurface scattering and diffuse reflection."""
        surface, add = self.surface, self._add
        if not surface.uses("metallic"):
            return self._dielectric(millimeter)
        metallic = self._unit("metallic")
        bsdf = None if _is(metallic, 1.0) else self._dielectric(millimeter)
        tint = {"color82": self._value("specular_color", self.writer.color)} if surface.uses("specular_color") else {}
        metal = add(
            "metal",
            "ND_generalized_schlick_bsdf",
            color0=self._value("base_color", lambda one: self.writer.color(unit(one))),
            roughness=self._alpha("specular"),
            **tint,
            **self._film(),
            **self._normal("normal"),
            **self._tangent(),
        )
        return add("substrate", "ND_mix_bsdf", fg=metal, bg=bsdf, mix=metallic) if bsdf else metal

    def _dielectric(self, millimeter: float) -> Output:
        below = self._below_specular(millimeter)
        if not self.surface.uses("specular_weight"):
            return below
        return self._add("glossy", "ND_layer_bsdf", top=self._specular(), base=below)

    def _below_specular(self, millimeter: float) -> Output:
        if not self.surface.uses("transmission_weight"):
            return self._opaque(millimeter)
        transmission = self._unit("transmission_weight")
        bsdf = None if _is(transmission, 1.0) else self._opaque(millimeter)
        glass = self._add(
            "transmission",
            "ND_dielectric_bsdf",
            tint=self._value("base_color", lambda one: self.writer.color(apply("sqrt", unit(one)))),  # as Cycles has it
            ior=self._value("specular_ior", self.writer.number),
            roughness=self._alpha("specular"),
            scatter_mode=Constant(STRING, "T"),
            **self._normal("normal"),
            **self._tangent(),
        )
        return self._add("inside", "ND_mix_bsdf", fg=glass, bg=bsdf, mix=transmission) if bsdf else glass

    def _opaque(self, millimeter: float) -> Output:
        if not self.surface.uses("subsurface_weight"):
            return self._diffuse()
        weight = self._unit("subsurface_weight")
        diffuse = None if _is(weight, 1.0) else self._diffuse()
        radius = apply("multiply", apply("maximum", self.surface["subsurface_radius"], 0.0), millimeter)
        scattered = self._add(
            "subsurface",
            "ND_subsurface_bsdf",
            color=self._value("base_color", lambda one: self.writer.color(unit(one))),
            radius=self._value("subsurface_radius", lambda _: self.writer.color(radius)),
            **self._given("subsurface_anisotropy", "anisotropy"),
            **self._normal("normal"),
        )
        return self._add("base", "ND_mix_bsdf", fg=scattered, bg=diffuse, mix=weight) if diffuse else scattered

    def _diffuse(self) -> Output:
        nearest = Nearest.of(self.surface)
        if nearest.stands_in:
            what = f"the reflectance model {nearest.model.label} in MaterialX"
            self.losses.append(Loss("", "", what, f"{nearest.stands_in} stands for it"))
        roughness = Constant(FLOAT, nearest.roughness)
        if nearest.has_own_roughness and self.surface.uses("diffuse_roughness"):
            high = 1.0 if nearest.compensated else 100.0
            roughness = self._value("diffuse_roughness", lambda one: self.writer.number(within(one, 0.0, high)))
        return self._add(
            "diffuse",
            "ND_oren_nayar_diffuse_bsdf",
            color=self._value("base_color", lambda one: self.writer.color(mapped(nearest.color, one))),
            roughness=roughness,
            energy_compensation=Constant(BOOL, nearest.compensated),
            **self._normal("normal"),
        )

    def _specular(self) -> Output:
        """Return the specular layer. A color tints its reflectance at normal incidence alone, as in Cycles."""
        surface, add = self.surface, self._add
        shared = {"roughness": self._alpha("specular")} | self._film() | self._normal("normal") | self._tangent()
        mirror = mirror_reflectance(surface)
        if not surface.uses("specular_color"):
            ior = surface["specular_ior"] if surface["specular_weight"] == Value(1.0) else index(mirror)
            return add(
                "specular", "ND_dielectric_bsdf", ior=self._value("specular_weight", lambda _: self.writer.number(ior)), **shared
            )
        color = apply("multiply", surface["specular_color"], mirror)
        color0 = self._value("specular_color", lambda _: self.writer.color(color))
        return add("specular", "ND_generalized_schlick_bsdf", color0=color0, **shared)

    def _coated(self, below: Output) -> Output:
        surface, add = self.surface, self._add
        if surface.uses("coat_color"):
            tint = apply("mix", (1.0, 1.0, 1.0), unit(surface["coat_color"]), unit(surface["coat_weight"]))
            color = self._value("coat_color", lambda _: self.writer.color(tint))
            below = add("below_coat", "ND_multiply_bsdfC", in1=below, in2=color)
        coat = add(
            "coat",
            "ND_dielectric_bsdf",
            weight=self._unit("coat_weight"),
            ior=self._value("coat_ior", lambda one: self.writer.number(within(one, 1.0, 100.0))),
            roughness=self._alpha("coat"),
            **self._normal("coat_normal"),
        )
        return add("layers", "ND_layer_bsdf", top=coat, base=below)

    def _highlight(self) -> Output:
        height, alpha = highlight(self.surface)
        roughness = self._value("highlight_exponent", lambda _: pair(*(self.writer.number(alpha),) * 2))
        return self._add(
            "highlight",
            "ND_generalized_schlick_bsdf",
            color0=self._value("highlight_weight", lambda _: self.writer.color(height)),
            color90=Constant(COLOR, (0.0,) * 3),
            exponent=Constant(FLOAT, 1.0),
            roughness=roughness,
            **self._normal("normal"),
        )

    def _emission(self) -> Output | None:
        surface = self.surface
        if not surface.uses("emission_strength"):
            return None
        color = apply("multiply", surface["emission_color"], surface["emission_strength"])
        if surface.uses("coat_weight") and surface.uses("coat_color"):
            color = apply("multiply", color, apply("mix", (1.0, 1.0, 1.0), surface["coat_color"], surface["coat_weight"]))
        return self._add("emission", "ND_uniform_edf", color=self._value("emission_color", lambda _: self.writer.color(color)))

    # inputs

    def _add(self, name: str, identifier: str, **inputs: Input) -> Output:
        return self.network.add(name, identifier, TOKEN, "out", **inputs)

    def _value(self, parameter: str, write: Callable[[Expression], Term]) -> Input:
        """Return what `write` makes of a parameter, or what it makes of its own value where MaterialX lacks the expression."""
        try:
            return write(self.surface[parameter]).value
        except Unsupported as problem:
            loss = Loss(parameter, problem.node, problem.what, OWN_VALUE)
            if loss not in self.losses:
                self.losses.append(loss)
        return write(self.own.get(parameter, Value(PARAMETERS[parameter]))).value

    def _unit(self, parameter: str) -> Input:
        return self._value(parameter, lambda one: self.writer.number(unit(one)))

    def _given(self, parameter: str, name: str) -> dict[str, Input]:
        return {name: self._value(parameter, self.writer.number)} if self.surface.uses(parameter) else {}

    def _normal(self, parameter: str) -> dict[str, Input]:
        """Return the input of a closure for its normal; none where that is the surface's own."""
        if not self.surface.uses(parameter):
            return {}
        try:
            return {"normal": self.writer.vector(self.surface[parameter]).value}
        except Unsupported as problem:
            loss = Loss(parameter, problem.node, problem.what, "the surface's own normal is written")
            if loss not in self.losses:
                self.losses.append(loss)
            return {}

    def _film(self) -> dict[str, Input]:
        if not self.surface.uses("thin_film_thickness"):
            return {}
        return self._given("thin_film_thickness", "thinfilm_thickness") | {
            "thinfilm_ior": self._value("thin_film_ior", self.writer.number)
        }

    def _alpha(self, layer: str) -> Input:
        """Return alpha of a microfacet lobe along both axes, the square of the roughness where they are equal."""
        if layer not in self._alphas:
            self._alphas[layer] = self._new_alpha(layer)
        return self._alphas[layer]

    def _new_alpha(self, layer: str) -> Input:
        roughness = f"{layer}_roughness"
        if layer == "specular" and self.surface.uses("specular_anisotropy"):
            anisotropy = apply("multiply", unit(self.surface["specular_anisotropy"]), ANISOTROPY)
            inputs = {"anisotropy": self._value("specular_anisotropy", lambda _: self.writer.number(anisotropy))}
            inputs["roughness"] = self._unit(roughness)
            return self.network.add("alpha", "ND_roughness_anisotropy", VECTOR2, "out", **inputs)
        value = Term(self.network, self._unit(roughness))
        if value.constant is not None:
            return Constant(VECTOR2, (value.constant**2, value.constant**2))
        return self.network.add("alpha", "ND_roughness_anisotropy", VECTOR2, roughness=value.value)

    def _tangent(self) -> dict[str, Input]:
        """Return the input of a closure for its tangent; none where it is the mesh's, or counts for nothing."""
        surface = self.surface
        if not surface.uses("specular_anisotropy") or not {"tangent", "specular_rotation"} & set(surface.inputs):
            return {}
        tangent = surface["tangent"] if surface.uses("tangent") else Coordinate("tangent")
        if surface.uses("specular_rotation"):
            normal = surface["normal"] if surface.uses("normal") else Coordinate("normal")
            tangent = apply("rotate_about", tangent, normal, apply("multiply", surface["specular_rotation"], tau))
        return {"tangent": self._value("tangent", lambda _: self.writer.vector(tangent))}


def mirror_reflectance(surface: Surface) -> Expression:
    """Return the specular layer's reflectance at normal incidence, before its color."""
    ior = surface["specular_ior"]
    root = apply("divide", apply("subtract", ior, 1.0), apply("add", ior, 1.0))
    scaled = apply("multiply", apply("multiply", root, root), surface["specular_weight"])
    return apply("clamp", scaled, 0.0, MAX_REFLECTANCE)


def index(reflectance: Expression) -> Expression:
    """Return the index of refraction of a dielectric with a reflectance at normal incidence."""
    root = apply("sqrt", reflectance)
    return apply("divide", apply("add", root, 1.0), apply("subtract", 1.0, root))


def highlight(surface: Surface) -> tuple[Expression, Expression]:
    """Return the height and alpha of Standard Specular's lobe."""
    exponent = within(surface["highlight_exponent"], 0.0, 10000.0)
    below = apply("add", exponent, 2.0)
    height = apply("divide", apply("multiply", unit(surface["highlight_weight"]), apply("add", exponent, 8.0)), below)
    return height, apply("sqrt", apply("divide", 2.0, below))


def unit(expression: Expression) -> Expression:
    """Return an expression within [0, 1]."""
    return expression if is_unit(expression) else apply("clamp", expression, 0.0, 1.0)


def is_unit(expression: Expression) -> bool:
    """Return whether an expression is known to be within [0, 1]."""
    if isinstance(expression, ImageTexture):
        return not expression.image.is_float and expression.interpolation != "Cubic"
    if isinstance(expression, Attribute):
        return True
    if isinstance(expression, Value):
        values = expression.value if isinstance(expression.value, tuple) else (expression.value,)
        return all(0.0 <= value <= 1.0 for value in values)
    match expression:
        case Apply("subtract", (Value(1 | 1.0), other)):
            return is_unit(other)
        case Apply("clamp", (_, Value(0 | 0.0), Value(1 | 1.0))):
            return True
        case Apply(operation, arguments):
            return operation in SWITCHES or (operation in BOUNDED and all(map(is_unit, arguments)))
    return False


def within(expression: Expression, low: float, high: float) -> Expression:
    """Return a number within [low, high]; one that is an image's is within [0, 1]."""
    if isinstance(expression, Value):
        return apply("clamp", expression, low, high)
    return expression if low <= 0.0 and high >= 1.0 and is_unit(expression) else apply("clamp", expression, low, high)


def mapped(function: Callable[[float], float], color: Expression) -> Expression:
    """Return `function` of each channel of a color; of one that varies, the color times `texture_factor`."""
    if isinstance(color, Value):
        channels = color.value if isinstance(color.value, tuple) else (color.value,) * 3
        red, green, blue = (function(clamp(channel, 0.0, 1.0)) for channel in channels)
        return Value((red, green, blue))
    return apply("multiply", unit(color), texture_factor(function))


def _is(value: Input, number: float) -> bool:
    return isinstance(value, Constant) and value.value == number
