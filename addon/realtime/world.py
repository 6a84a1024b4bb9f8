# SPDX-License-Identifier: GPL-3.0-or-later
"""A world's node tree as radiance by direction: expressions of `position`, which is the unit vector towards what is seen."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import bpy

from mathutils import Matrix

from ..material.expression import (
    Attribute,
    Bump,
    Constant,
    Coordinate,
    Expression,
    NormalMap,
    UvMap,
    apply,
    as_kind,
    rewritten,
    triple,
)
from ..material.links import Place, is_nothing, source
from ..material.read_nodes import NodeReader, UnsupportedInput
from ..material.sky import Sun
from ..material.suns import DIRECTION, is_sky_alone, without_suns
from ..material.surface import Rgb
from .expressions import Code, NotDrawn, Writer
from .meshes import is_finite
from .not_drawn import Omission

RADIANCE = "radiance"  # the member of MaterialInputs
RAYS = {"camera": "Is Camera Ray", "diffuse": "Is Diffuse Ray", "glossy": "Is Glossy Ray"}
"""By the name of their visibility, the outputs of the node Light Path."""
BLACK = Constant((0.0, 0.0, 0.0))
BACK = apply("multiply", DIRECTION, -1.0)
# What nodes get for the background in Cycles, whose point is the direction, with a normal against it
COORDINATES: Mapping[str, Expression] = {
    **dict.fromkeys(("generated", "object", "position"), DIRECTION),
    **dict.fromkeys(("normal", "true_normal", "incoming", "object_normal", "reflection"), BACK),
    "tangent": BLACK,
    "backfacing": Constant(0.0),
}

type Radiance = Rgb | Code
"""One color [W/(m^2 sr)], or GLSL of it by direction."""


@dataclass(frozen=True)
class World:
    """The radiance that the camera sees, and that of diffuse and of glossy reflection; the last two without the known `suns`.

    What is brighter than `sun_threshold` [W/(m^2 sr)] in any channel becomes suns, too, nothing where that is 0, and all cast
    shadows if `has_shadows`. `resolution`: across the map that glossy surfaces reflect [texels]. `images` are Blender's by full
    name.
    """

    camera: Radiance
    diffuse: Radiance
    glossy: Radiance
    suns: tuple[Sun, ...] = ()
    sun_threshold: float = 0.0
    has_shadows: bool = True
    resolution: int = 1024
    images: Mapping[str, bpy.types.Image] = field(default_factory=dict, compare=False, hash=False)

    @property
    def is_even(self) -> bool:
        """Whether the world shines alike from everywhere."""
        return isinstance(self.diffuse, tuple) and self.diffuse == self.glossy

    @property
    def may_have_suns(self) -> bool:
        """Whether suns are looked for in its map."""
        return isinstance(self.diffuse, Code) and self.sun_threshold > 0.0

    @property
    def codes(self) -> tuple[Code, ...]:
        """All that is computed by direction, without repetition."""
        return tuple(dict.fromkeys(one for one in (self.camera, self.diffuse, self.glossy) if isinstance(one, Code)))


NO_WORLD = World((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass
class Reading:
    """A world that has been read: what is not drawn of it, and whether it moves with an object."""

    world: World = NO_WORLD
    said: list[Omission] = field(default_factory=list)
    follows_object: bool = False


def read_world(world: bpy.types.World | None, depsgraph: bpy.types.Depsgraph, max_images: int) -> Reading:
    """Return an evaluated world as it is drawn by shaders that read at most `max_images` images."""
    if world is None:
        return Reading()
    output = world.node_tree.get_output_node("ALL") if world.node_tree else None
    if output is None:
        color = tuple(world.color)
        return Reading(World(color, color, color))
    reader = _WorldReader(world, depsgraph)
    made: dict[str, Radiance] = {}
    suns: tuple[Sun, ...] = ()
    threshold = 0.0
    for ray, light_path in RAYS.items():
        reader.begin(light_path)
        is_visible = getattr(world.cycles_visibility, ray) if hasattr(world, "cycles_visibility") else True
        expression = reader.radiance(Place(output.inputs["Surface"])) if is_visible else BLACK
        if ray != "camera":
            expression, found = without_suns(expression)
        if ray == "diffuse":
            suns = tuple(found)
            threshold = 0.0 if is_sky_alone(expression) else world.sun_threshold  # the glow around a sky's sun is wide
        made[ray] = reader.written(expression, max_images)
    has_shadows, resolution = world.use_sun_shadow, int(world.probe_resolution)
    read = World(**made, suns=suns, sun_threshold=threshold, has_shadows=has_shadows, resolution=resolution, images=reader.images)
    return Reading(read, list(dict.fromkeys(reader.said)), reader.follows_object)


class _WorldReader:
    """Reads the closures of a world for one kind of ray after the other."""

    def __init__(self, world: bpy.types.World, depsgraph: bpy.types.Depsgraph) -> None:
        self.said: list[Omission] = []
        self.images: dict[str, bpy.types.Image] = {}
        self.follows_object = False
        self._name, self._depsgraph = world.name, depsgraph

    def begin(self, light_path: str) -> None:
        """Read what rays see of which the node Light Path says `light_path`."""
        self._reader = NodeReader(light_path)

    def radiance(self, place: Place) -> Expression:
        """Return the radiance of the closure that feeds an input."""
        made = source(place)
        if not made.socket.is_output or is_nothing(made):
            return BLACK
        match made.node.bl_idname:
            case "ShaderNodeBackground" | "ShaderNodeEmission":
                color, strength = (self._input(made.input(name)) for name in ("Color", "Strength"))
                return apply("multiply", color, strength)
            case "ShaderNodeAddShader":
                return apply("add", self.radiance(made.input(0)), self.radiance(made.input(1)))
            case "ShaderNodeMixShader":
                factor = apply("clamp", self._input(made.input(0)), 0.0, 1.0)
                if factor in (Constant(0.0), Constant(1.0)):
                    return self.radiance(made.input(1 if factor == Constant(0.0) else 2))
                return apply("mix", self.radiance(made.input(1)), self.radiance(made.input(2)), factor)
        self._say(f"the world is black where its node {made.node.bl_label} would shine")
        return BLACK

    def written(self, expression: Expression, max_images: int) -> Radiance:
        """Return an expression as a color or as GLSL; black, and said, where the engine does not draw it."""
        expression = as_kind(expression, "triple")
        if isinstance(expression, Constant):
            color = triple(expression.value)
            if is_finite(color):
                return color
            self._say("the world is black, as its radiance is not finite or too large")
            return triple(BLACK.value)
        writer = Writer(max_images)
        try:
            writer.add(RADIANCE, expression)
        except NotDrawn as problem:
            self._say(f"the world is black, as {problem} cannot be drawn")
            return triple(BLACK.value)
        self.images |= self._reader.images
        return writer.code()

    def _input(self, place: Place) -> Expression:
        """Return what feeds an input, or its own value, and say so, where that cannot be read."""
        try:
            return self._of_direction(self._reader.expression(place), place.label)
        except UnsupportedInput as problem:
            self._say(f"{problem} is not drawn, the {place.socket.name} of the node {place.label} itself is")
            return self._reader.own(place)

    def _of_direction(self, expression: Expression, label: str) -> Expression:
        """Return an expression with what it has of a surface's point made of the direction alone. Raises UnsupportedInput."""

        def change(one: Expression) -> Expression | None:
            match one:
                case Coordinate(name, owner):
                    return self._coordinate(name, owner, label)
                case Attribute() | UvMap():  # which a world has not
                    return as_kind(Constant(0.0), one.kind)
                case NormalMap() | Bump():
                    raise UnsupportedInput(label, f"the node {'Bump' if isinstance(one, Bump) else 'Normal Map'} in a world")
            return None

        return rewritten(expression, change)

    def _coordinate(self, name: str, owner: str, label: str) -> Expression:
        if name not in COORDINATES:
            raise UnsupportedInput(label, f"{name.capitalize()} coordinates")
        if not owner:
            return COORDINATES[name]
        item = bpy.data.objects.get(owner)
        if item is None:
            raise UnsupportedInput(label, f"the coordinates of {owner}")
        self.follows_object = True
        return transformed(item.evaluated_get(self._depsgraph).matrix_world.inverted_safe(), DIRECTION)

    def _say(self, what: str) -> None:
        self.said.append(Omission("WORLD", what, self._name))


def transformed(matrix: Matrix, point: Expression) -> Expression:
    """Return a point moved by a matrix."""

    def components() -> Iterator[Expression]:
        for row in matrix[:3]:
            along = apply("dot", point, tuple(row[:3]))
            yield apply("add", along, row[3])

    return apply("combine", *components())
