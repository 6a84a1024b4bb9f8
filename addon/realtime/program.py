# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime shaders as text: one variant for each combination of model, inputs and kinds of lights in use. No bpy.

A variant holds nothing that it does not need. Blender's gpu module declares a program's inputs and outputs, from what `Program`
lists.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum

from ..blender.glsl import FULLSCREEN_VERTEX_SHADER, SHADERS, source
from .models import GlslModel

MAX_LIGHTS = 64
LIGHT_TYPES = ("SUN", "POINT", "SPOT", "AREA")  # Blender's; a light's number in the shader is its index here
# Only vectors and matrices of four components, where the std140 layout of uniform blocks pads nothing
STRUCTS = {
    "View": "mat4 projection; vec4 camera; vec4 world;",
    "Material": "vec4 color; vec4 shape; vec4 coat; vec4 scattering;",
    "Lights": f"ivec4 count; Light light[{MAX_LIGHTS}];",
    "Shadows": f"mat4 matrix[{MAX_LIGHTS}]; vec4 tile[{MAX_LIGHTS}]; vec4 texel[{MAX_LIGHTS}];",
    "Gather": "vec4 size; vec4 offset;",
}
GATHER_MAPS = ("radiance_map", "entering_map", "distance_map", "tint_map")  # the surface shader's outputs, in their order


class ColorInput(StrEnum):
    """What multiplies a material's color at each point; the value is the shader's definition."""

    NONE = ""
    ATTRIBUTE = "COLOR_ATTRIBUTE"
    IMAGE = "COLOR_IMAGE"


@dataclass(frozen=True)
class Lighting:
    """What a scene's lights ask of every surface shader: their `types`, of LIGHT_TYPES, shadow maps, an ambient term."""

    types: frozenset[str] = frozenset()
    shadows: bool = False
    ambient: bool = False


@dataclass(frozen=True)
class Variant:
    """What determines a surface shader.

    `subsurface`: the material has subsurface scattering. `subsurface_in_scene`: some material has, so that all shaders write the
    outputs that the gather pass reads.
    """

    model: GlslModel
    color_input: ColorInput
    coat: bool
    subsurface: bool
    subsurface_in_scene: bool
    lighting: Lighting
    normal_map: bool = False


@dataclass(frozen=True)
class Program:
    """A vertex and a fragment shader with their inputs and outputs: types by name, in the order of their locations."""

    name: str
    vertex: str
    fragment: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    varyings: Mapping[str, str] = field(default_factory=dict)
    constants: Mapping[str, str] = field(default_factory=dict)
    samplers: Mapping[str, str] = field(default_factory=dict)
    uniform_blocks: Mapping[str, str] = field(default_factory=dict)  # the blocks' structs by name
    outputs: tuple[str, ...] = ("result",)
    declarations: str = ""  # of structs that the blocks' structs contain


def surface_program(variant: Variant) -> Program:
    """Return the program that draws surfaces under all lights. Raises ValueError for a type of light it does not know."""
    model, lighting = variant.model, variant.lighting
    if unknown := lighting.types - set(LIGHT_TYPES):
        raise ValueError(f"unknown types of light: {', '.join(sorted(unknown))}")
    stems = [model.stem]
    definitions = [f"{name} {number}.0" for number, name in enumerate(LIGHT_TYPES) if name in lighting.types]
    for is_used, name, included in (
        (lighting.shadows, "SHADOWS", ()),
        (lighting.ambient, "AMBIENT", (model.ambient_stem,) if model.ambient_stem else ()),
        (variant.coat, "COAT", ("coat",)),
        (variant.subsurface, "SUBSURFACE", ("burley",)),
        (variant.subsurface_in_scene, "SUBSURFACE_IN_SCENE", ()),
        (variant.color_input, str(variant.color_input), ()),
        (variant.normal_map, "NORMAL_MAP", ()),
    ):
        if is_used:
            definitions.append(name)
            stems += included
    # one type of light needs no branch
    light_type = next(iter(lighting.types)) if len(lighting.types) == 1 else "light.position.w"
    definitions += [
        f"LIGHT_TYPE(light) {light_type}",
        f"SURFACE {model.surface}",
        f"RADIANCE {model.radiance}",
        f"ALBEDO(mu) {model.ambient}",
    ]
    defines = "\n".join(f"#define {definition}" for definition in definitions)
    comment, rest = source("lights").split("struct Light {", 1)
    members, functions = rest.split("};", 1)  # the struct is declared before the uniform blocks, which contain it
    attributes, varyings = {"position": "VEC3", "normal": "VEC3"}, {"world_position": "VEC3", "world_normal": "VEC3"}
    samplers = {"shadow_map": "FLOAT_2D"} if lighting.shadows else {}
    if variant.color_input is ColorInput.ATTRIBUTE:
        attributes["color"] = varyings["vertex_color"] = "VEC4"
    if variant.color_input is ColorInput.IMAGE:
        attributes["uv"] = varyings["vertex_uv"] = "VEC2"
        samplers["color_image"] = "FLOAT_2D"
    if variant.normal_map:
        attributes |= {"normal_uv": "VEC2", "tangent": "VEC4"}
        varyings |= {"vertex_normal_uv": "VEC2", "object_normal": "VEC3", "object_tangent": "VEC4"}
        samplers["normal_image"] = "FLOAT_2D"
    transform = _file("transform_normal")
    blocks = {"view": "View", "material": "Material", "lights": "Lights"} | ({"shadows": "Shadows"} if lighting.shadows else {})
    return Program(
        name="true_diffuse_surface",
        vertex="\n".join((defines, transform, _file("surface_vertex"))),
        fragment="\n".join(
            (
                defines,
                transform if variant.normal_map else "",
                comment,
                functions,
                source(*stems),
                model.more,
                _file("surface_fragment"),
            )
        ),
        attributes=attributes,
        varyings=varyings,
        constants={"object_matrix": "MAT4", "orientation": "FLOAT"} | ({"object_number": "INT"} if variant.subsurface else {}),
        samplers=samplers,
        uniform_blocks=blocks,
        outputs=("out_radiance", *(("out_entering", "out_distance", "out_tint") if variant.subsurface_in_scene else ())),
        declarations=f"struct Light {{{members}}};\n",
    )


def shadow_program() -> Program:
    """Return the program that draws a shadow map: the distance of surfaces from a light."""
    return Program(
        name="true_diffuse_shadow",
        vertex="void main() { gl_Position = matrix * vec4(position, 1.0); }",
        fragment=_file("shadow_fragment"),
        attributes={"position": "VEC3", "normal": "VEC3"},
        # from the object to the light's clip space; push constants hold two matrices, but Blender takes some of that
        constants={"matrix": "MAT4"},
    )


def subsurface_gather_program() -> Program:
    """Return the program that adds subsurface scattering to a sample."""
    return _fullscreen_program("subsurface_gather", GATHER_MAPS, {}, "burley", gather="Gather")


def accumulate_program() -> Program:
    """Return the program that adds a sample to the sum."""
    return _fullscreen_program("accumulate", ("radiance_map",), {"background": "VEC4"})


def resolve_program() -> Program:
    """Return the program that draws the mean of all samples."""
    return _fullscreen_program("resolve", ("sum_map",), {"weight": "FLOAT", "corner": "VEC2"})


def _fullscreen_program(
    name: str, samplers: Sequence[str], constants: Mapping[str, str], *stems: str, **uniform_blocks: str
) -> Program:
    """Return the program that runs shaders/realtime/NAME.glsl for every pixel, with shaders/STEM.glsl of `stems` before it."""
    return Program(
        name=f"true_diffuse_{name}",
        vertex=FULLSCREEN_VERTEX_SHADER,
        fragment="\n".join((source(*stems), _file(name))),
        attributes={"position": "VEC2"},
        constants=constants,
        samplers=dict.fromkeys(samplers, "FLOAT_2D"),
        uniform_blocks=uniform_blocks,
    )


def struct_declarations(program: Program) -> str:
    """Return the GLSL declarations of the structs in `program`'s uniform blocks."""
    blocks = program.uniform_blocks.values()
    return program.declarations + "".join(f"struct {name} {{ {STRUCTS[name]} }};\n" for name in blocks)


def _file(name: str) -> str:
    return (SHADERS / "realtime" / f"{name}.glsl").read_text()
