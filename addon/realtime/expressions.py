# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions as GLSL: one statement for each node, shared nodes once, numbers in a uniform block. No bpy.

The text depends on the structure of the expressions alone. So a number that is dragged changes the block, never the shader.
"""

import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field, fields

from ..material.expression import (
    EXPRESSIONS,
    Apply,
    Attribute,
    Bump,
    Constant,
    Coordinate,
    Curve,
    Expression,
    Image,
    ImageTexture,
    NormalMap,
    SkyTexture,
    UvMap,
    children,
)
from ..material.operations import OPERATIONS, Kind
from ..material.sky import Atmosphere

TYPES: Mapping[Kind, str] = {"number": "float", "triple": "vec3"}
WIDTHS = {"uv": 2, "attribute": 4, "generated": 3, "tangent": 4}
"""Components of each kind of attribute of a mesh."""
MAX_ATTRIBUTES = 12  # of 16 that every driver has, without position and normal
MAX_VALUES = 1000  # vec4 of the 1024 that a uniform block of every driver holds

EXTENSIONS = {"REPEAT": 0, "EXTEND": 1, "CLIP": 2, "MIRROR": 3}
INTERPOLATIONS = {"Linear": "linear", "Closest": "closest", "Cubic": "cubic", "Smart": "cubic"}

# Of Coordinate, what GLSL has for it, where it is no attribute
COORDINATES = {
    "object": "point.object",
    "object_normal": "normal_of_object()",
    "reflection": "reflect(-incoming_at(point.position), surface_normal())",
    "position": "point.position",
    "normal": "surface_normal()",
    "true_normal": "true_normal()",
    "incoming": "incoming_at(point.position)",
    "tangent": "tangent_of_generated(point.{generated})",
    "backfacing": "(is_front() ? 0.0 : 1.0)",
}

type MeshAttribute = tuple[str, str]
"""Its kind, a key of WIDTHS, and the name of the mesh's attribute or UV map that it is made of."""


def attribute_name(attribute: MeshAttribute) -> str:
    """Return the name that shaders have for an attribute, whatever characters are in Blender's."""
    kind, name = attribute
    return f"{kind}_{zlib.crc32(name.encode()):08x}"


class NotDrawn(Exception):
    """An expression that the engine does not draw; the message says what it is, `label` names its node."""

    def __init__(self, what: str, label: str = "") -> None:
        super().__init__(what)
        self.label = label


@dataclass(frozen=True)
class Code:
    """GLSL of a few parameters, and what it reads.

    `text` declares the struct Point, the struct MaterialInputs with a member for each parameter, and `material_inputs`, which
    returns it for a Point. `values` fill the vec4 array `material.values`. `images` are those of the samplers image_0, image_1,
    and so on, an Atmosphere standing for the map of its sky. `attributes` are the members of Point besides position and object.
    `stems` name files of functions.
    """

    text: str
    values: tuple[float, ...]
    images: tuple[Image | Atmosphere, ...]
    attributes: tuple[MeshAttribute, ...]
    stems: tuple[str, ...]


@dataclass
class _Scope:
    """A function of a point under construction: its statements, and the variables that hold what is computed already."""

    statements: list[str] = field(default_factory=list)
    variables: dict[int | str, str] = field(default_factory=dict)


@dataclass
class Writer:
    """Writes GLSL for the parameters that `add` is called with, which may read up to `max_images` images."""

    max_images: int
    _values: list[float] = field(default_factory=list)
    _images: dict[str | Atmosphere, Image | Atmosphere] = field(default_factory=dict)
    _attributes: dict[MeshAttribute, None] = field(default_factory=dict)
    _stems: dict[str, None] = field(default_factory=dict)
    _functions: list[str] = field(default_factory=list)
    _scope: _Scope = field(default_factory=_Scope)
    _members: dict[str, tuple[str, str]] = field(default_factory=dict)
    _keys: dict[int, tuple[Expression, int]] = field(default_factory=dict)
    _numbers: dict[tuple[object, ...], int] = field(default_factory=dict)

    def add(self, parameter: str, expression: Expression) -> None:
        """Add a parameter. Raises NotDrawn, and adds nothing then, where the engine does not draw its expression."""
        before = self._saved()
        try:
            variable = self._variable(expression)
        except NotDrawn:
            self._restore(before)
            raise
        self._members[parameter] = (TYPES[expression.kind], variable)

    def add_numbers(self, parameter: str, numbers: tuple[float, ...]) -> None:
        """Add a parameter that is up to four constant numbers."""
        self._members[parameter] = (_vector(len(numbers)), self._slot(numbers))

    def add_call(self, parameter: str, kind: str, call: str) -> None:
        """Add a parameter of a GLSL type that is a function of parameters added before, which `call` names."""
        arguments = {name: variable for name, (_, variable) in self._members.items()}
        self._members[parameter] = (kind, call.format(**arguments))

    def code(self) -> Code:
        """Return what has been added."""
        attributes = tuple(self._attributes)
        names = [attribute_name(attribute) for attribute in attributes]
        point = "".join(f" {_vector(WIDTHS[kind])} {name};" for (kind, _), name in zip(attributes, names, strict=True))
        members = " ".join(f"{kind} {name};" for name, (kind, _) in self._members.items())
        values = ", ".join(variable for _, variable in self._members.values())
        shifted = (f"point.{name} + x * dFdx(point.{name}) + y * dFdy(point.{name})" for name in ("position", "object", *names))
        text = "\n".join(
            (
                f"struct Point {{ vec3 position; vec3 object;{point} }};",
                f"struct MaterialInputs {{ {members} }};",
                "// Returns what is x and y pixels beside a point.",
                f"Point beside(Point point, float x, float y) {{ return Point({', '.join(shifted)}); }}",
                *self._functions,
                "MaterialInputs material_inputs(Point point)",
                "{",
                *(f"    {line}" for line in self._scope.statements),
                f"    return MaterialInputs({values});",
                "}",
            )
        )
        padded = (*self._values, *(0.0,) * (-len(self._values) % 4 or 4 * (not self._values)))
        return Code(text, padded, tuple(self._images.values()), attributes, tuple(self._stems))

    def _saved(self) -> tuple[int, dict, dict, dict, int, int, dict]:
        scope = self._scope
        return (
            len(self._values),
            dict(self._images),
            dict(self._attributes),
            dict(self._stems),
            len(self._functions),
            len(scope.statements),
            dict(scope.variables),
        )

    def _restore(self, saved: tuple[int, dict, dict, dict, int, int, dict]) -> None:
        values, self._images, self._attributes, self._stems, functions, statements, self._scope.variables = saved
        del self._values[values:], self._functions[functions:], self._scope.statements[statements:]

    # ---- expressions

    def _variable(self, expression: Expression) -> str:
        """Return the name of a variable with the value of `expression`, or what reads it where it is a constant."""
        if isinstance(expression, Constant):  # each use has its own numbers, as two equal ones may differ later
            return self._slot(expression.value if isinstance(expression.value, tuple) else (expression.value,))
        variables, key = self._scope.variables, self._key(expression)
        if key not in variables:
            variables[key] = self._stored(TYPES[expression.kind], self._value(expression))
        return variables[key]

    def _key(self, one: Expression) -> int:
        """Return a number that equal expressions share, found in one visit of each node."""
        if id(one) not in self._keys:
            own = (getattr(one, item.name) for item in fields(one) if item.compare)
            plain = (
                tuple(item for item in own if not isinstance(item, EXPRESSIONS)) if not isinstance(one, Apply) else one.operation
            )
            below = tuple(self._key(child) for child in children(one))
            number = self._numbers.setdefault((type(one), plain, below), len(self._numbers))
            self._keys[id(one)] = one, number  # kept, so that no other expression gets its id
        return self._keys[id(one)][1]

    def _stored(self, kind: str, value: str) -> str:
        """Add a statement that keeps `value` in a variable, whose name is returned."""
        name = f"x{len(self._scope.statements)}"
        self._scope.statements.append(f"{kind} {name} = {value};")
        return name

    def _value(self, one: Expression) -> str:
        match one:
            case UvMap(name):
                return f"vec3({self._member(('uv', name))}, 0.0)"
            case Attribute():
                return self._attribute(one)
            case Coordinate():
                return self._coordinate(one)
            case ImageTexture():
                return self._texture(one)
            case Apply():
                return self._apply(one)
            case Curve(points, argument, is_stepped, is_extended):
                x = self._variable(argument)
                start = self._slots([number for point in points for number in point])
                self._use("realtime/curve")
                return f"curve_value({start}, {len(points)}, {x}, {_boolean(is_stepped)}, {_boolean(is_extended)})"
            case NormalMap():
                return self._normal_map(one)
            case Bump():
                return self._bump(one)
            case SkyTexture():
                return self._sky(one)
        raise TypeError(f"{one!r} is no expression that varies")

    def _apply(self, one: Apply) -> str:
        entry = OPERATIONS[one.operation]
        if not entry.glsl:
            raise NotDrawn(one.operation.replace("_", " ").capitalize(), one.label)
        arguments = [self._variable(argument) for argument in one.arguments]
        if entry.stem:
            self._use(entry.stem)
        if not entry.kind and one.kind == "triple":
            pairs = zip(arguments, one.arguments, strict=True)
            arguments = [text if argument.kind == "triple" else f"vec3({text})" for text, argument in pairs]
        return entry.glsl.format(*arguments)

    def _attribute(self, one: Attribute) -> str:
        if one.owner != "GEOMETRY":
            raise NotDrawn(f"the attribute {one.name} of the {one.owner.lower().replace('_', ' ')}")
        member = self._member(("attribute", one.name))
        return {
            "color": f"{member}.rgb",
            "vector": f"{member}.xyz",
            "factor": f"dot({member}.rgb, vec3(1.0 / 3.0))",
            "alpha": f"{member}.a",
        }[one.output]

    def _coordinate(self, one: Coordinate) -> str:
        if one.owner:
            raise NotDrawn(f"coordinates of the object {one.owner}")
        if one.name == "generated":
            return self._member(("generated", ""))
        if one.name not in COORDINATES:
            raise NotDrawn(f"{one.name.capitalize()} coordinates")
        if one.name == "tangent":
            self._member(("generated", ""))
        return COORDINATES[one.name].format(generated=attribute_name(("generated", "")))

    def _texture(self, one: ImageTexture) -> str:
        image = one.image
        if one.projection != "FLAT":
            raise NotDrawn(f"the image {image.name} in {one.projection.capitalize()} projection")
        if image.source not in ("FILE", "GENERATED"):
            raise NotDrawn(f"the image {image.name} ({image.source.lower()})")
        coordinates = self._variable(one.coordinates)
        sampler = self._sampler(image.name, image, f"the image {image.name}")
        self._use("realtime/image")
        function = f"image_{INTERPOLATIONS[one.interpolation]}"
        lookup = f"{function}({sampler}, {coordinates}.xy, {EXTENSIONS[one.extension]}, {storage(image)})"
        if lookup not in self._scope.variables:  # color and alpha share it
            self._scope.variables[lookup] = self._stored("vec4", lookup)
        texel = self._scope.variables[lookup]
        if one.output == "alpha":
            return "1.0" if image.alpha_mode == "NONE" else f"{texel}.a"
        return f"image_color({texel}, {_boolean(one.is_unassociated and not is_raw(image))}, {_boolean(is_encoded(image))})"

    def _sampler(self, key: str | Atmosphere, image: Image | Atmosphere, what: str) -> str:
        """Return the name of the sampler of an image or of a sky's map."""
        if key not in self._images and len(self._images) == self.max_images:
            raise NotDrawn(f"{what} beyond the {self.max_images} images that the driver holds")
        self._images[key] = image
        return f"image_{list(self._images).index(key)}"

    def _sky(self, one: SkyTexture) -> str:
        sky, direction = one.sky, self._variable(one.direction)
        sampler, rotation = self._sampler(sky.atmosphere, sky.atmosphere, "the sky"), self._slot((sky.sun_rotation,))
        self._use("realtime/sky")
        xyz = f"sky_xyz({sampler}, {direction}, {rotation})"
        if sky.disc:
            place = self._slot((sky.atmosphere.sun_elevation, sky.disc.diameter, sky.lowest_elevation))
            low, high = map(self._slot, sky.disc_ends)
            xyz += f" + sun_xyz({direction}, {rotation}, {place}, {low}, {high})"
        return f"rgb_of_xyz({xyz})"

    def _normal_map(self, one: NormalMap) -> str:
        self._use("realtime/normal_map")
        color, strength = self._variable(one.color), self._variable(one.strength)
        if one.space == "TANGENT":
            sign = "-1.0" if one.convention == "DIRECTX" else "1.0"
            return f"tangent_space_normal({color}, {strength}, {sign}, {self._member(('tangent', one.uv_map))})"
        space, sign = "object" if "OBJECT" in one.space else "world", "-1.0" if one.space.startswith("BLENDER") else "1.0"
        return f"{space}_space_normal({color}, {strength}, {sign})"

    def _bump(self, one: Bump) -> str:
        """Write the height as a function of a point, to be evaluated at the point and beside it."""
        self._use("realtime/bump")
        outer, self._scope = self._scope, _Scope()
        try:
            height = self._variable(one.height)
            lines = "".join(f"    {line}\n" for line in self._scope.statements)
        finally:
            self._scope = outer
        name = f"height_{len(self._functions)}"
        self._functions.append(f"float {name}(Point point)\n{{\n{lines}    return {height};\n}}")
        width = self._slot((one.filter_width,))
        beside = f"{name}(beside(point, {width}, 0.0)), {name}(beside(point, 0.0, {width}))"
        heights = self._stored("vec3", f"vec3({name}(point), {beside})")
        normal = f"safe_normal({self._variable(one.normal)})" if one.normal else "surface_normal()"
        distance = f"{'-' if one.is_inverted else ''}{self._variable(one.distance)}"
        return f"bumped({normal}, {heights}, {self._variable(one.strength)}, {distance}, {width})"

    # ---- what expressions read

    def _slot(self, numbers: tuple[float, ...]) -> str:
        """Return what reads up to four numbers from the block."""
        start = self._slots(list(numbers), together=True)
        return f"material.values[{start // 4}].{'xyzw'[start % 4 : start % 4 + len(numbers)]}"

    def _slots(self, numbers: list[float], together: bool = False) -> int:
        """Put numbers into the block and return where they start, in one vec4 where they have to be `together`."""
        if together and len(self._values) % 4 + len(numbers) > 4:
            self._values += [0.0] * (-len(self._values) % 4)
        start = len(self._values)
        self._values += numbers
        if len(self._values) > 4 * MAX_VALUES:
            raise NotDrawn(f"a curve beyond the {4 * MAX_VALUES} numbers that a shader reads")
        return start

    def _member(self, attribute: MeshAttribute) -> str:
        if attribute not in self._attributes and len(self._attributes) == MAX_ATTRIBUTES:
            raise NotDrawn(f"the attribute {attribute[1] or attribute[0]} beyond the {MAX_ATTRIBUTES} that a shader reads")
        self._attributes[attribute] = None
        return f"point.{attribute_name(attribute)}"

    def _use(self, stem: str) -> None:
        self._stems[stem] = None


def _boolean(value: bool) -> str:
    return "true" if value else "false"


def _vector(width: int) -> str:
    return f"vec{width}" if width > 1 else "float"


def is_raw(image: Image) -> bool:
    """Return whether the alpha of `image` leaves its color alone."""
    return image.is_data or image.alpha_mode in ("CHANNEL_PACKED", "NONE")


def is_encoded(image: Image) -> bool:
    """Return whether the driver has the pixels as bytes of sRGB, which Cycles filters before it decodes them."""
    return image.color_space == "sRGB" and not image.is_float and not image.is_data


def storage(image: Image) -> int:
    """Return what shaders/realtime/image.glsl does to a texel before it is filtered: 1: encode to sRGB, 2: multiply by alpha."""
    return is_encoded(image) + 2 * (not is_raw(image) and image.alpha_mode == "STRAIGHT")
