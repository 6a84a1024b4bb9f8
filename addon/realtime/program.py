# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime shaders as text: one variant for each combination of model, inputs and lamps in use. No bpy.

What a variant does not need is not in it. Blender's gpu module declares a program's inputs and outputs itself, from what `Program`
lists; `declared` does so for any other driver of OpenGL 3.3.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum

from ..blender.glsl import FULLSCREEN_VERTEX_SHADER, SHADERS, source
from .laws import LAMBERT, Law

MOST_LAMPS = 64
KINDS = ("SUN", "POINT", "SPOT", "AREA")  # as Blender calls them, in the order of shaders/lights.glsl
STRUCTS = {
    "View": "mat4 projection; vec4 camera; vec4 world;",
    "Material": "vec4 color; vec4 shape; vec4 coat; vec4 scattering;",
    "Lamps": f"ivec4 count; Lamp lamp[{MOST_LAMPS}];",
    "Shadows": f"mat4 matrix[{MOST_LAMPS}]; vec4 tile[{MOST_LAMPS}]; vec4 texel[{MOST_LAMPS}];",
    "Gather": "vec4 size; vec4 turn;",
}
TYPES = {"FLOAT": "float", "INT": "int", "VEC2": "vec2", "VEC3": "vec3", "VEC4": "vec4", "MAT4": "mat4"}


class Paint(StrEnum):
    """What a material's color is multiplied with, at each point."""

    NOTHING = ""
    ATTRIBUTE = "COLOR_ATTRIBUTE"
    IMAGE = "COLOR_IMAGE"


class Relief(StrEnum):
    """What turns the normals within a face."""

    NOTHING = ""
    TANGENT = "NORMAL_MAP"


@dataclass(frozen=True)
class Light:
    """What a scene's light asks of every shader: kinds of lamps, shadows, an ambient term."""

    kinds: frozenset[str] = frozenset()
    shadows: bool = False
    ambient: bool = False


@dataclass(frozen=True)
class Variant:
    """A surface shader. `scatters`: the material does; `scattering`: something in the scene does, so all write what that needs."""

    law: Law
    paint: Paint
    coat: bool
    scatters: bool
    scattering: bool
    light: Light
    relief: Relief = Relief.NOTHING


@dataclass(frozen=True)
class Program:
    """A vertex and a fragment shader, and what goes in and out: names by type, in the order of their places."""

    name: str
    vertex: str
    fragment: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    varyings: Mapping[str, str] = field(default_factory=dict)
    constants: Mapping[str, str] = field(default_factory=dict)
    samplers: Mapping[str, str] = field(default_factory=dict)
    blocks: Mapping[str, str] = field(default_factory=dict)  # structs by name
    outputs: tuple[str, ...] = ("result",)
    types: str = ""  # structs that the blocks are made of


def _file(name: str) -> str:
    return (SHADERS / "realtime" / f"{name}.glsl").read_text()


def surface(variant: Variant) -> Program:
    """Return the program that draws surfaces under all lamps."""
    law, light = variant.law, variant.light
    stems, defines = [law.stem], [f"{kind} {number}.0" for number, kind in enumerate(KINDS) if kind in light.kinds]
    for used, name, needs in (
        (light.shadows, "SHADOWS", ()),
        (light.ambient, "AMBIENT", () if law is LAMBERT else ("directional_albedo",)),
        (variant.coat, "COAT", ("coat",)),
        (variant.scatters, "SCATTERS", ("burley",)),
        (variant.scattering, "SCATTERING", ()),
        (variant.paint, str(variant.paint), ()),
        (variant.relief, str(variant.relief), ()),
    ):
        if used:
            defines.append(name)
            stems += needs
    comment, rest = source("lights").split("struct Lamp {", 1)
    members, functions = rest.split("};", 1)  # the struct is declared ahead, for the blocks
    kind = next(iter(light.kinds)) if len(light.kinds) == 1 else "lamp.place.w"  # what is the same for all is not looked up
    lines = [f"#define {name}" for name in (*defines, f"KIND(lamp) {kind}")]
    lines += [f"#define SURFACE {law.surface}", f"#define RADIANCE {law.radiance}", f"#define ALBEDO(mu) {law.ambient}"]
    attributes, varyings = {"position": "VEC3", "normal": "VEC3"}, {"world_position": "VEC3", "world_normal": "VEC3"}
    if variant.paint is Paint.ATTRIBUTE:
        attributes["color"] = varyings["vertex_color"] = "VEC4"
    if variant.paint is Paint.IMAGE:
        attributes["uv"] = varyings["vertex_uv"] = "VEC2"
    if variant.relief:
        attributes |= {"relief_uv": "VEC2", "tangent": "VEC4"}
        varyings |= {"vertex_relief_uv": "VEC2", "object_normal": "VEC3", "object_tangent": "VEC4"}
    samplers = {"shadow_map": light.shadows, "color_image": variant.paint is Paint.IMAGE, "relief_image": bool(variant.relief)}
    turned = _file("turned")
    blocks = {"view": "View", "material": "Material", "lamps": "Lamps"} | ({"shadows": "Shadows"} if light.shadows else {})
    return Program(
        "true_diffuse_surface",
        "\n".join((*lines, turned, _file("surface_vertex"))),
        "\n".join((*lines, turned * bool(variant.relief), comment, functions, source(*stems), law.more, _file("surface_fragment"))),
        attributes,
        varyings,
        {"object_matrix": "MAT4", "orientation": "FLOAT"} | ({"object_number": "INT"} if variant.scatters else {}),
        dict.fromkeys((name for name, is_used in samplers.items() if is_used), "FLOAT_2D"),
        blocks,
        ("out_radiance", *(("out_entering", "out_distance", "out_tint") if variant.scattering else ())),
        f"struct Lamp {{{members}}};\n",
    )


def shadow() -> Program:
    """Return the program that draws how far from a lamp surfaces are."""
    return Program(
        "true_diffuse_shadow",
        "void main() { gl_Position = matrix * vec4(position, 1.0); }",
        _file("shadow_fragment"),
        {"position": "VEC3", "normal": "VEC3"},
        constants={"matrix": "MAT4"},  # from the object to the lamp's clip space: there is room for two, but Blender takes some
    )


def whole(
    name: str, samplers: Mapping[str, str], constants: Mapping[str, str], stems: tuple[str, ...] = (), **blocks: str
) -> Program:
    """Return the program of shaders/realtime/NAME.glsl, which covers the picture; `stems` of shaders/ are included before it."""
    return Program(
        f"true_diffuse_{name}",
        FULLSCREEN_VERTEX_SHADER,
        "\n".join((source(*stems), _file(name))),
        {"position": "VEC2"},
        constants=constants,
        samplers=samplers,
        blocks=blocks,
    )


def structs(program: Program) -> str:
    """Return the declarations of the structs that `program`'s blocks are made of, for std140: vectors and matrices of four."""
    return program.types + "".join(f"struct {kind} {{ {STRUCTS[kind]} }};\n" for kind in program.blocks.values())


def declared(program: Program) -> tuple[str, str]:
    """Return `program`'s vertex and fragment shader with all declarations, for OpenGL 3.3."""
    common = "#version 330\n" + structs(program)
    common += "".join(f"layout(std140) uniform {name}_block {{ {kind} {name}; }};\n" for name, kind in program.blocks.items())
    common += "".join(f"uniform {TYPES[kind]} {name};\n" for name, kind in program.constants.items())
    common += "".join(f"uniform sampler2D {name};\n" for name in program.samplers)

    def through(direction: str, names: Mapping[str, str]) -> str:
        return "".join(f"{direction} {TYPES[kind]} {name};\n" for name, kind in names.items())

    outputs = "".join(f"layout(location = {place}) out vec4 {name};\n" for place, name in enumerate(program.outputs))
    vertex = common + through("in", program.attributes) + through("out", program.varyings) + program.vertex
    return vertex, common + through("in", program.varyings) + outputs + program.fragment
