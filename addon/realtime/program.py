# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime shaders as text: one variant for each combination of model, inputs and kinds of lights in use. No bpy.

A variant holds nothing that it does not need. Blender's gpu module declares a program's inputs and outputs, from what `Program`
lists.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from ..blender.glsl import FULLSCREEN_VERTEX_SHADER, SHADERS, source
from ..material.sky import BANDS
from ..models.color import LUMINANCE
from .expressions import WIDTHS, Code, attribute_name
from .models import GlslModel

MAX_LIGHTS = 64
MAX_BUNDLES = 4  # directions of a sample's ray bundles
TRANSPARENT_DEPTH = 2.0  # added to the depth of what some samples see through, in their maps
LIGHT_TYPES = ("SUN", "POINT", "SPOT", "AREA")  # Blender's; a light's number in the shader is its index here
MAX_WORLD_SUNS = 4
MAX_TILES = 16  # of a map of the world
# Only vectors and matrices of four components, where the std140 layout of uniform blocks pads nothing
STRUCTS = {
    "View": "mat4 projection; vec4 camera; vec4 world;",
    "Lights": f"ivec4 count; Light light[{MAX_LIGHTS}];",
    "Gather": "mat4 projection; mat4 from_pixel; vec4 depth; vec4 eye; vec4 ambient; vec4 size; vec4 offset;",
    "WorldTiles": f"vec4 tile[{MAX_TILES}];",
    "Caps": f"vec4 cap[{MAX_WORLD_SUNS}];",
    "Bundles": f"mat4 matrix[{MAX_BUNDLES}]; vec4 towards[{MAX_BUNDLES}]; vec4 sky[{MAX_BUNDLES}]; vec4 low; vec4 high; vec4 use;",
}
_LUMINANCE = f"#define LUMINANCE {', '.join(map(str, LUMINANCE))}\n"
SHADOW_TEXTURES = ("shadow_map", "shadow_tiles")
# Files of functions that the features of a material need
FEATURE_STEMS: Mapping[str, tuple[str, ...]] = {
    "SUBSURFACE": ("burley",),
    "HIGHLIGHT": ("blinn_phong",),
    "FUZZ": ("sheen",),
    "COAT": ("ggx",),
    "AVERAGED_COAT": ("coat",),
    "METAL": ("ggx",),
    "SPECULAR": ("ggx",),
    "TRANSMISSION": ("ggx",),
}


MESH_VERTEX = ("transform_normal", "surface_vertex")
MESH_VARYINGS = dict.fromkeys(("world_position", "world_normal", "object_position", "object_normal"), "VEC3")
STRIP_VERTEX = ("strip", "strip_vertex")
STRIP_VARYINGS = {"strip_position": "VEC3", "object_position": "VEC3", "strip_across": "VEC4", "strip_facing": "VEC4"}


@dataclass(frozen=True)
class Lighting:
    """What a scene's lights ask of every surface shader: their `types`, of LIGHT_TYPES, shadow maps, an ambient term, ray bundles.

    `world_map`: the ambient term is of a world that varies.
    """

    types: frozenset[str] = frozenset()
    shadows: bool = False
    ambient: bool = False
    world_map: bool = False
    bounce: bool = False


@dataclass(frozen=True)
class Inputs:
    """The part of a Code that makes its shader, without the values of its numbers."""

    text: str
    attributes: tuple[tuple[str, str], ...]
    stems: tuple[str, ...]
    images: int
    vectors: int
    """Of four numbers, in the block."""
    is_strip: bool = False
    """Whether strips along curves show it, rather than meshes."""

    @classmethod
    def of(cls, code: Code, is_strip: bool = False) -> "Inputs":
        """Return that part of `code`."""
        return cls(code.text, code.attributes, code.stems, len(code.images), len(code.values) // 4, is_strip)


@dataclass(frozen=True)
class Data:
    """What a shader writes of a surface in place of its light: `value`, in GLSL.

    A surface is there if its opacity is at least `threshold`; None: by chance, as samples of the light see through it.
    """

    value: str
    threshold: float | None

    @property
    def has_number(self) -> bool:
        """Whether it reads a number of each object, from the texture `numbers`."""
        return "numbers" in self.value


@dataclass(frozen=True)
class Variant:
    """What determines a surface shader.

    `features` are the material's. `subsurface_in_scene`: some material has subsurface scattering, so that all shaders write the
    outputs that the gather pass reads. `data` is what it writes in place of light. `is_layer`: it draws a layer of a ray bundle in
    place of the picture.
    """

    model: GlslModel
    inputs: Inputs
    features: frozenset[str]
    subsurface_in_scene: bool
    lighting: Lighting
    data: Data | None = None
    is_layer: bool = False


@dataclass(frozen=True)
class Program:
    """A vertex and a fragment shader with their inputs and outputs: types by name, in the order of their locations."""

    name: str
    vertex: str
    fragment: str
    attributes: Mapping[str, str] = field(default_factory=dict)
    varyings: Mapping[str, str] = field(default_factory=dict)
    flat_varyings: Mapping[str, str] = field(default_factory=dict)  # not interpolated
    constants: Mapping[str, str] = field(default_factory=dict)
    samplers: Mapping[str, str] = field(default_factory=dict)
    uniform_blocks: Mapping[str, str] = field(default_factory=dict)  # the blocks' structs by name
    outputs: tuple[str, ...] = ("result",)
    declarations: str = ""  # of structs that STRUCTS lacks, or that its structs contain


def reads_table(features: frozenset[str]) -> bool:
    """Return whether the shader of a material with `features` reads the table of specular albedos."""
    specular = {"METAL", "SPECULAR", "TRANSMISSION"} | ({"COAT"} if "AVERAGED_COAT" not in features else set())
    return bool(features & specular)


def gather_maps(has_shadows: bool) -> tuple[str, ...]:
    """Return what the gather pass reads, the surface shader's outputs in their order; the last for light that the camera misses."""
    return ("radiance_map", "entering_map", "distance_map", "tint_map", *(("medium_map",) if has_shadows else ()))


def surface_program(variant: Variant) -> Program:
    """Return the program that draws surfaces under all lights. Raises ValueError for a type of light it does not know."""
    model, lighting, features = variant.model, variant.lighting, variant.features
    has_table = reads_table(features)
    base = model.base or model
    splits = lighting.world_map or lighting.bounce  # a highlight from the rest
    stems = [base.stem, model.stem]
    if lighting.ambient and model.ambient_stem:
        stems.append(model.ambient_stem)
    stems += [stem for feature in sorted(features) for stem in FEATURE_STEMS.get(feature, ())]
    definitions = [*_light_definitions(lighting.types), *sorted(features)]
    for is_used, name in (
        (lighting.shadows, "SHADOWS"),
        (lighting.ambient, "AMBIENT"),
        (lighting.world_map, "WORLD_MAP"),
        (lighting.world_map and base.stem != "lambert", "SHAPED"),
        (lighting.bounce, "BOUNCE"),
        (variant.is_layer, "LAYER"),
        (lighting.bounce or variant.is_layer, f"TRANSPARENT_DEPTH {TRANSPARENT_DEPTH}"),
        (has_table, "SPECULAR_TABLE"),
        (variant.subsurface_in_scene, "SUBSURFACE_IN_SCENE"),
    ):
        if is_used:
            definitions.append(name)
    if variant.data:
        definitions.append(f"DATA {variant.data.value}")
        if variant.data.threshold is not None:
            definitions.append(f"THRESHOLD {variant.data.threshold}")
    definitions += [
        f"SURFACE {model.surface}",
        f"RADIANCE {model.radiance}",
        f"ALBEDO(mu) {model.ambient}",
    ]
    if splits:
        definitions += [f"BASE_RADIANCE {base.radiance}", f"BASE_ALBEDO(mu) {base.ambient}"]
    light, functions = _light_source()
    more = [functions, source(*stems), model.more]
    if has_table:
        more.append(_file("specular_albedo"))
    if lighting.world_map:
        more += [_file("hemispheres"), _file("world_light")]
    if lighting.bounce:
        more.append(_file("ray_bundles"))
    if variant.is_layer:
        more.append(_file("bundle_layer"))
    maps = gather_maps(lighting.shadows) if variant.subsurface_in_scene else ()
    if "medium_map" in maps:
        more.append(_file("packed_normal"))
    return _material_program(
        "true_diffuse_surface",
        variant.inputs,
        definitions,
        more,
        "surface_fragment",
        samplers=(dict.fromkeys(SHADOW_TEXTURES, "FLOAT_2D") if lighting.shadows else {})
        | ({"specular_table": "FLOAT_2D"} if has_table else {})
        | ({"world_map": "FLOAT_2D"} if lighting.world_map else {})
        | ({"bundle_map": "FLOAT_2D", "bundle_depths": "FLOAT_2D"} if lighting.bounce else {})
        | ({"farther_map": "DEPTH_2D"} if variant.is_layer else {})
        | ({"numbers": "FLOAT_2D"} if variant.data and variant.data.has_number else {}),
        blocks=({} if variant.data else {"lights": "Lights"})
        | ({"world_tiles": "WorldTiles"} if lighting.world_map else {})
        | ({"bundles": "Bundles"} if lighting.bounce else {}),
        constants={"layer": "IVEC2"} if variant.is_layer else {},
        outputs=(*surface_outputs(maps), *(("out_depth",) if variant.is_layer else ())),
        declarations=light,
    )


def surface_outputs(maps: Sequence[str]) -> tuple[str, ...]:
    """Return the outputs of what draws into a sample of the picture, where the gather pass reads `maps`."""
    return tuple(f"out_{name.removesuffix('_map')}" for name in maps or ("radiance_map",))


def _light_definitions(types: frozenset[str]) -> list[str]:
    """Return the definitions of the types of lights in use. Raises ValueError for one that it does not know."""
    if unknown := types - set(LIGHT_TYPES):
        raise ValueError(f"unknown types of light: {', '.join(sorted(unknown))}")
    # one type of light needs no branch
    light_type = next(iter(types)) if len(types) == 1 else "light.position.w"
    used = [f"{name} {number}.0" for number, name in enumerate(LIGHT_TYPES) if name in types]
    return [*used, f"LIGHT_TYPE(light) {light_type}"]


def _light_source() -> tuple[str, str]:
    """Return the struct of a light, which is declared before the uniform blocks, as they contain it, and the lights' functions."""
    comment, rest = source("lights").split("struct Light {", 1)
    members, functions = rest.split("};", 1)
    return f"struct Light {{{members}}};\n", "\n".join((comment, functions, _file("light_irradiance")))


def transparent_shadow_program(inputs: Inputs, is_marked: bool) -> Program:
    """Return the program that draws a material of `inputs` into a shadow map where its opacity is above a random threshold.

    `is_marked`: the map says which object it shows.
    """
    marks = [_file("packed_normal"), _file("surface_mark")] if is_marked else []
    name, fragment = "true_diffuse_transparent_shadow", "transparent_shadow_fragment"
    return _material_program(name, inputs, ["MARKED"] if is_marked else [], marks, fragment)


def _material_program(
    name: str,
    inputs: Inputs,
    definitions: Sequence[str],
    functions: Sequence[str],
    fragment: str,
    samplers: Mapping[str, str] | None = None,
    blocks: Mapping[str, str] | None = None,
    constants: Mapping[str, str] | None = None,
    outputs: tuple[str, ...] = ("result",),
    declarations: str = "",
) -> Program:
    """Return a program that draws meshes or strips by a material's `inputs`.

    `fragment` is a file of shaders/realtime, which comes after `functions`.
    """
    names = {attribute_name(attribute): f"VEC{WIDTHS[attribute[0]]}" for attribute in inputs.attributes}
    passed = "".join(f" varying_{one} = {one};" for one in names)
    point = ", ".join(("world_position", "object_position", *(f"varying_{one}" for one in names)))
    if inputs.is_strip:
        definitions = (*definitions, "STRIP")
    defines = "\n".join(f"#define {one}" for one in (*definitions, f"PASS_ATTRIBUTES{passed}", f"SHADED_POINT Point({point})"))
    return Program(
        name=name,
        vertex="\n".join((defines, _file("objects"), *map(_file, STRIP_VERTEX if inputs.is_strip else MESH_VERTEX))),
        fragment="\n".join(
            (
                defines,
                _file("objects"),
                _file("transform_normal"),
                *((_file("strip_point"),) if inputs.is_strip else ()),
                _file("shaded_point"),
                _file("transparency"),
                *functions,
                source(*inputs.stems),
                inputs.text,
                _file(fragment),
            )
        ),
        attributes=({"strip": "VEC4"} if inputs.is_strip else {"position": "VEC3", "normal": "VEC3"}) | names,
        varyings=(STRIP_VARYINGS if inputs.is_strip else MESH_VARYINGS) | {f"varying_{one}": kind for one, kind in names.items()},
        flat_varyings={"object_index": "INT", "orientation": "FLOAT"},
        constants={"first_object": "INT"} | dict(constants or {}),
        samplers={"objects": "FLOAT_2D"}
        | ({"strip_points": "FLOAT_2D"} if inputs.is_strip else {})
        | dict(samplers or {})
        | {f"image_{index}": "FLOAT_2D" for index in range(inputs.images)},
        uniform_blocks={"view": "View", "material": "Material"} | dict(blocks or {}),
        outputs=outputs,
        declarations=f"{declarations}struct Material {{ vec4 values[{inputs.vectors}]; }};\n",
    )


def shadow_program(is_marked: bool) -> Program:
    """Return the program that draws a shadow map: the distance of surfaces from a light; `is_marked`: and which object they are."""
    place = "object_matrix_of(first_object + gl_InstanceID) * vec4(position, 1.0)"
    passed = "object_index = first_object + gl_InstanceID; world_position = world.xyz; " if is_marked else ""
    marks = ("#define MARKED", _file("objects"), _file("packed_normal"), _file("surface_mark")) if is_marked else ()
    return Program(
        name="true_diffuse_shadow",
        vertex=f"{_file('objects')}void main() {{ vec4 world = {place}; {passed}gl_Position = matrix * world; }}",
        fragment="\n".join((*marks, _file("shadow_fragment"))),
        attributes={"position": "VEC3", "normal": "VEC3"},
        varyings={"world_position": "VEC3"} if is_marked else {},
        flat_varyings={"object_index": "INT"} if is_marked else {},
        constants={"matrix": "MAT4", "first_object": "INT"},  # from the world to the light's clip space
        samplers={"objects": "FLOAT_2D"},
    )


def strip_shadow_program() -> Program:
    """Return the program that draws curves into a shadow map, as strips that face the light."""
    return replace(
        shadow_program(is_marked=False),
        name="true_diffuse_strip_shadow",
        vertex="\n".join(map(_file, ("objects", "strip", "strip_shadow_vertex"))),
        attributes={"strip": "VEC4"},
        constants={"matrix": "MAT4", "eye": "VEC4", "first_object": "INT"},
        samplers={"objects": "FLOAT_2D", "strip_points": "FLOAT_2D"},
    )


def specular_table_program() -> Program:
    """Return the program that integrates the table of specular albedos."""
    return _fullscreen_program("specular_table", (), {}, "ggx")


def sky_program(name: str, constants: str) -> Program:
    """Return the program that computes a table of a sky by shaders/realtime/NAME.glsl, after the definitions `constants`."""
    is_table, is_multiple = name == "sky_transmittance", name == "sky_multiple_scattering"
    numbers = {"densities": "VEC3"} | ({} if is_table else {"sun_elevation": "FLOAT", "altitude": "FLOAT"})
    made = _fullscreen_program(name, ("transmittance",) if is_multiple else (), numbers)
    is_single = not (is_table or is_multiple)
    return replace(
        made,
        fragment=constants + ("" if is_single else _file("sky_air")) + made.fragment,
        uniform_blocks={"spectrum": "Spectrum"} if is_single else {},
        declarations=f"struct Spectrum {{ vec4 band[{BANDS}]; }};\n",
    )


def world_radiance_program(inputs: Inputs) -> Program:
    """Return the program that computes the octahedral map of a world of `inputs`, and what of it makes suns."""
    constants = {"size": "FLOAT", "threshold": "FLOAT", "bright": "FLOAT", "subsamples": "INT", "fine": "INT"}
    outputs = ("out_radiance", "out_excess", "out_moment")
    return replace(_world_program("world_radiance", inputs, constants, _LUMINANCE), outputs=outputs)


def world_background_program(inputs: Inputs, subsurface_in_scene: bool) -> Program:
    """Return the program that draws a world of `inputs` where no surface is."""
    constants = dict.fromkeys(("right", "up", "forward", "pixel"), "VEC4")
    definitions = "#define SUBSURFACE_IN_SCENE\n" if subsurface_in_scene else ""
    made = _world_program("world_background", inputs, constants, definitions)
    behind = "void main() { gl_Position = vec4(position, 1.0, 1.0); }"  # at the far end
    return replace(made, vertex=behind, outputs=surface_outputs(gather_maps(has_shadows=False) if subsurface_in_scene else ()))


def world_suns_program() -> Program:
    """Return the program that sums what makes suns over blocks of texels."""
    made = _sphere_program("world_suns", ("radiance_map", "excess_map", "moment_map"), {"block": "INT"})
    return replace(made, fragment=_LUMINANCE + made.fragment, outputs=("out_power", "out_moment"))


def world_remaining_program() -> Program:
    """Return the program that takes the suns out of a world."""
    made = _sphere_program("world_remaining", ("radiance_map", "excess_map"), {"block": "INT"}, caps="Caps")
    return replace(made, fragment=f"#define SUNS {MAX_WORLD_SUNS}\n{made.fragment}")


def world_reduce_program() -> Program:
    """Return the program that makes a smaller tile of a map of a world."""
    return _sphere_program("world_reduce", ("radiance_map",), {"tile": "VEC4"})


def world_convolved_program() -> Program:
    """Return the program that averages a world around each direction."""
    return _sphere_program("world_convolved", ("world_map",), {"tile": "VEC4", "source": "VEC4", "sharpness": "FLOAT"})


def world_glossy_program() -> Program:
    """Return the program that blurs a world as a rough surface reflects it."""
    constants = {"tile": "VEC4", "alpha": "FLOAT", "samples": "INT"}
    return _sphere_program("world_glossy", ("world_map",), constants, world_tiles="WorldTiles")


def _sphere_program(name: str, samplers: Sequence[str], constants: Mapping[str, str], **uniform_blocks: str) -> Program:
    """Return a full-screen program with the functions of octahedral.glsl and hemispheres.glsl."""
    made = _fullscreen_program(name, samplers, constants, **uniform_blocks)
    return replace(made, fragment=_file("octahedral") + _file("hemispheres") + made.fragment)


def _world_program(name: str, inputs: Inputs, constants: Mapping[str, str], definitions: str) -> Program:
    """Return the program that runs shaders/realtime/NAME.glsl for every pixel, after the `inputs` of a world."""
    made = _fullscreen_program(name, [f"image_{index}" for index in range(inputs.images)], constants, material="Material")
    functions = "\n".join((definitions, _file("octahedral"), source(*inputs.stems), inputs.text))
    declarations = f"struct Material {{ vec4 values[{inputs.vectors}]; }};\n"
    return replace(made, fragment=f"{functions}\n{made.fragment}", declarations=declarations)


def subsurface_gather_program(lights: frozenset[str]) -> Program:
    """Return the program that adds subsurface scattering to a sample.

    `lights`: the types of lights if any casts shadows, whose maps then show where light enters that the camera does not see.
    """
    maps = gather_maps(bool(lights))
    plain = _fullscreen_program("subsurface_gather", maps, {}, "burley", gather="Gather")
    if not lights:
        return plain
    light, functions = _light_source()
    definitions = "".join(f"#define {one}\n" for one in ("SHADOWS", *_light_definitions(lights)))
    parts = [_file(name) for name in ("packed_normal", "slab_profile", "light_through", "subsurface_gather")]
    return replace(
        plain,
        fragment="\n".join((definitions, source("burley"), functions, *parts)),
        samplers=dict.fromkeys((*maps, *SHADOW_TEXTURES), "FLOAT_2D"),
        uniform_blocks={"gather": "Gather", "lights": "Lights"},
        declarations=light,
    )


def accumulate_program() -> Program:
    """Return the program that adds a sample to the sum."""
    return _fullscreen_program("accumulate", ("radiance_map",), {"background": "VEC4"})


def resolve_program() -> Program:
    """Return the program that draws the mean of all samples."""
    return _fullscreen_program("resolve", ("sum_map",), {"weight": "FLOAT", "corner": "VEC2", "least": "FLOAT"})


def depth_program() -> Program:
    """Return the program that turns the depth of surfaces into their distance along the view's axis."""
    return replace(_fullscreen_program("depth", (), {"distances": "VEC4"}), samplers={"depth_map": "DEPTH_2D"})


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
    names = [name for name in program.uniform_blocks.values() if name in STRUCTS]
    return program.declarations + "".join(f"struct {name} {{ {STRUCTS[name]} }};\n" for name in names)


def _file(name: str) -> str:
    return (SHADERS / "realtime" / f"{name}.glsl").read_text()
