# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials as the realtime engine draws them: the GLSL of their inputs, the layers they have, and what is not drawn."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field

import bpy

import gpu

from ..material.expression import Constant, Coordinate, Expression, Image, apply, number, triple
from ..material.read import read_surface
from ..material.sky import Atmosphere
from ..material.surface import PARAMETERS, Loss, Surface
from ..models.registry import Parameter
from .expressions import Code, MeshAttribute, NotDrawn, Writer
from .models import GlslModel, glsl_model, with_highlight

MILLIMETER = 0.001  # m
REACH = 10.0  # mean free paths: of what lights a slab of red skin from behind, less than 1 % comes through as much
VARYING_RADIUS = 0.001  # m
GRAY = (0.8, 0.8, 0.8)  # Blender's color of faces without a material
OUR_SAMPLERS = 5  # where objects are, the shadow map and its tiles, the table of specular albedos, and the map of the world
FEWEST_SAMPLERS = 16  # of any driver

# The layers and parts of a surface, by the parameter that makes a material have them: each a definition for the shaders
FEATURES: Mapping[str, str] = {
    "metallic": "METAL",
    "transmission_weight": "TRANSMISSION",
    "subsurface_weight": "SUBSURFACE",
    "specular_weight": "SPECULAR",
    "highlight_weight": "HIGHLIGHT",
    "coat_weight": "COAT",
    "fuzz_weight": "FUZZ",
    "emission_strength": "EMISSION",
    "opacity": "OPACITY",
    "normal": "NORMAL",
    "coat_normal": "COAT_NORMAL",
    "specular_anisotropy": "ANISOTROPY",
}
GLOSSY = frozenset({"METAL", "TRANSMISSION", "SPECULAR", "HIGHLIGHT", "COAT"})  # which reflect the world more or less sharply
HOLDOUT = "HOLDOUT"  # the definition that makes a shader draw a hole in the picture
# The parameters that the shader of a feature reads, beside that which makes it
READ: Mapping[str, tuple[str, ...]] = {
    "METAL": ("specular_roughness", "specular_color"),
    "TRANSMISSION": ("specular_roughness", "specular_ior", "specular_color"),
    "SUBSURFACE": ("subsurface_radius",),
    "SPECULAR": ("specular_roughness", "specular_ior", "specular_color"),
    "HIGHLIGHT": ("highlight_exponent",),
    "COAT": ("coat_roughness", "coat_ior", "coat_color"),
    "FUZZ": ("fuzz_color", "fuzz_roughness"),
    "EMISSION": ("emission_color",),
    "ANISOTROPY": ("specular_rotation", "tangent"),
}
# A feature counts for nothing without one of these
REQUIRED: Mapping[str, tuple[str, ...]] = {
    "COAT_NORMAL": ("COAT",),
    "ANISOTROPY": ("METAL", "SPECULAR", "TRANSMISSION"),
}
NOT_DRAWN: Mapping[str, tuple[str, str]] = {
    "thin_film_thickness": ("Thin Film", "the surface is drawn without it"),
    "transmission_weight": ("refraction", "light passes straight through, in the base color"),
}


@dataclass(frozen=True)
class RenderMaterial:
    """A material as it is drawn.

    `features` are definitions for the shaders. `code` computes its inputs, `shadow_code` the opacity alone, for shadows; None where
    it is opaque. `losses` say what is not drawn. `subsurface_reach` is how far light goes below the surface [m]. `images` are
    Blender's by the names that the code has, as far as they exist.
    """

    model: GlslModel
    features: frozenset[str]
    code: Code
    shadow_code: Code | None = None
    losses: tuple[Loss, ...] = ()
    subsurface_reach: float = 0.0
    images: Mapping[str, bpy.types.Image] = field(default_factory=dict, compare=False, hash=False)

    @property
    def attributes(self) -> tuple[MeshAttribute, ...]:
        """The attributes that its meshes must have on the driver."""
        shadow = self.shadow_code.attributes if self.shadow_code else ()
        return tuple(dict.fromkeys((*self.code.attributes, *shadow)))

    @property
    def textures(self) -> tuple[Image | Atmosphere, ...]:
        """Its images and, as their air, its skies."""
        return tuple(dict.fromkeys((*self.code.images, *(self.shadow_code.images if self.shadow_code else ()))))

    @property
    def has_subsurface(self) -> bool:
        """Whether light scatters below the surface."""
        return "SUBSURFACE" in self.features

    @property
    def is_transparent(self) -> bool:
        """Whether some samples see through it."""
        return self.shadow_code is not None

    @property
    def missing(self) -> tuple[str, ...]:
        """The names of its images of which there are no pixels to draw."""
        return tuple(one.name for one in self.textures if isinstance(one, Image) and self.is_missing(one))

    def is_missing(self, image: Image) -> bool:
        """Return whether there are no pixels of `image` to draw."""
        found = self.images.get(image.name)
        return found is None or (not found.has_data and not found.size[0])


def values_to_bytes(code: Code) -> bytes:
    """Return the struct Material of the shaders."""
    return struct.pack(f"{len(code.values)}f", *code.values)


def render_material(material: bpy.types.Material | None, meter: float) -> RenderMaterial:
    """Return how `material` is drawn; `meter` is the length of a meter in the scene's units."""
    if material is None:
        return surface_material(Surface("lambert", {"base_color": Constant(GRAY)}), meter)
    reading = read_surface(material, 1.0 / meter)
    losses = tuple(reading.losses)
    if material.use_backface_culling_shadow:
        losses += (Loss("", "", "backface culling of shadows", "all faces cast them"),)
    return surface_material(reading.surface, meter, losses, reading.images)


def surface_material(
    surface: Surface, meter: float, losses: tuple[Loss, ...] = (), images: Mapping[str, bpy.types.Image] | None = None
) -> RenderMaterial:
    """Return how `surface` is drawn; `losses` are those of its reading, `images` Blender's by full name."""
    said = list(losses)
    features = features_of(surface)
    writer = Writer(samplers() - OUR_SAMPLERS)
    names = ["base_color", *(name for name, feature in FEATURES.items() if feature in features)]
    names += dict.fromkeys(name for feature, read in READ.items() if feature in features for name in read if name not in names)
    for name in names:
        _add(writer, name, _scaled(surface, name, meter), said)
    model = glsl_model(surface.reflectance)
    parameter = surface.reflectance.parameter
    if parameter:
        _add_shape(writer, surface, model, parameter, said)
    if "HIGHLIGHT" in features:
        model = with_highlight(model)
    shadow_code = None
    if features & {"OPACITY", "TRANSMISSION"}:
        shadow = Writer(samplers() - OUR_SAMPLERS)
        for name in ("opacity", "transmission_weight", "metallic", "base_color"):
            _add(shadow, name, surface[name], [])
        shadow_code = shadow.code()
    said += [Loss(name, "", what, instead) for name, (what, instead) in NOT_DRAWN.items() if surface.uses(name)]
    reach = _subsurface_reach(surface, meter) if "SUBSURFACE" in features else 0.0
    return RenderMaterial(model, features, writer.code(), shadow_code, tuple(dict.fromkeys(said)), reach, images or {})


def plain_material(model: GlslModel, albedo: float, shape: tuple[float, ...]) -> RenderMaterial:
    """Return a gray surface of a `model` with the numbers `shape`, without any layer."""
    writer = Writer(0)
    writer.add("base_color", Constant((albedo, albedo, albedo)))
    if shape:
        writer.add_numbers("shape", shape)
    return RenderMaterial(model, frozenset(), writer.code())


def features_of(surface: Surface) -> frozenset[str]:
    """Return the definitions that the shaders of `surface` have."""
    found = {feature for name, feature in FEATURES.items() if surface.uses(name) and surface[name] != Constant(PARAMETERS[name])}
    if surface["subsurface_radius"] == Constant((0.0, 0.0, 0.0)):
        found.discard("SUBSURFACE")
    for feature, either in REQUIRED.items():
        if not found & set(either):
            found.discard(feature)
    if found & {"METAL", "SPECULAR", "TRANSMISSION"} and surface.is_multi_scattering:
        found.add("MULTIPLE_SCATTERING")
    if "COAT" in found and surface.is_coat_averaged:
        found.add("AVERAGED_COAT")
    if surface.is_culled:
        found.add("CULLED")
    return frozenset(found)


def _add(writer: Writer, name: str, expression: Expression, said: list[Loss]) -> None:
    """Add a parameter, or its default and a loss where its expression is not drawn."""
    try:
        writer.add(name, expression)
    except NotDrawn as problem:
        default = PARAMETERS[name]
        shown = "the surface's own" if "normal" in name or name == "tangent" else f"{default}"
        said.append(Loss(name, problem.label, str(problem), f"{shown} is drawn instead"))
        writer.add(name, Constant(default))


def _add_shape(writer: Writer, surface: Surface, model: GlslModel, parameter: Parameter, said: list[Loss]) -> None:
    """Add the numbers that a model computes of its parameter: here of a constant, in the shader of what varies."""
    expression = surface[surface.model_parameter]
    if isinstance(expression, Constant):
        writer.add_numbers("shape", model.constants({parameter.socket: number(expression.value)}))
        return
    _add(writer, surface.model_parameter, expression, said)
    count = len(model.constants({parameter.socket: parameter.usual}))
    kind = f"vec{count}" if count > 1 else "float"
    writer.add_call("shape", kind, f"{model.coefficients}({{{surface.model_parameter}}})")


def _scaled(surface: Surface, name: str, meter: float) -> Expression:
    """Return a parameter in the shaders' units."""
    expression = surface[name]
    if name == "subsurface_radius":
        return apply("multiply", expression, MILLIMETER * meter)
    return Coordinate("tangent") if name == "tangent" and not surface.uses(name) else expression


def _subsurface_reach(surface: Surface, meter: float) -> float:
    """Return how far light goes below a surface [m]; a radius that varies counts as VARYING_RADIUS."""
    radius = _scaled(surface, "subsurface_radius", meter)
    return REACH * (max(triple(radius.value)) if isinstance(radius, Constant) else VARYING_RADIUS)


def samplers() -> int:
    """Return how many images a shader may read here."""
    try:
        return gpu.capabilities.max_textures_frag_get()
    except SystemError:  # no graphics context yet, as before a first render without a window
        return FEWEST_SAMPLERS
