# SPDX-License-Identifier: GPL-3.0-or-later
"""What feeds an input of a surface, as a typed tree of plain values that all targets read. No bpy.

An expression is a number or a triple (a color, linear Rec. 709, or a vector). `read_nodes.py` makes expressions of Blender's nodes;
`operations.py` says for every operation how each target computes it. `evaluate` is the reference: what Cycles computes.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, fields
from typing import Literal, Protocol

from .operations import OPERATIONS, Kind, Triple, Value, broadcast


@dataclass(frozen=True)
class Constant:
    """A number or a triple."""

    value: Value

    @property
    def kind(self) -> Kind:
        """Number or triple."""
        return "triple" if isinstance(self.value, tuple) else "number"


@dataclass(frozen=True)
class Image:
    """An image data-block of Blender by its full name, and how its pixels are meant."""

    name: str
    color_space: str
    """Blender's name of the color space, such as "sRGB"."""
    is_data: bool
    """Whether the pixels are numbers rather than colors (Non-Color)."""
    alpha_mode: Literal["STRAIGHT", "PREMUL", "CHANNEL_PACKED", "NONE"] = "STRAIGHT"
    source: Literal["FILE", "GENERATED", "TILED", "SEQUENCE", "MOVIE", "VIEWER"] = "FILE"
    is_float: bool = False


@dataclass(frozen=True)
class ImageTexture:
    """An image looked up at `coordinates`, of which x and y count where `projection` is FLAT.

    The color is multiplied by the alpha unless the node's Alpha is linked, too (`is_unassociated`), or the image says otherwise:
    so both engines do.
    """

    image: Image
    coordinates: "Expression"
    output: Literal["color", "alpha"] = "color"
    extension: Literal["REPEAT", "EXTEND", "CLIP", "MIRROR"] = "REPEAT"
    interpolation: Literal["Linear", "Closest", "Cubic", "Smart"] = "Linear"
    projection: Literal["FLAT", "BOX", "SPHERE", "TUBE"] = "FLAT"
    blend: float = 0.0
    """Width of the blending between the sides of a BOX, 0 to 1."""
    is_unassociated: bool = False
    frame: tuple[int, int, int] = (0, 0, 0)
    """Of an image sequence or movie: start, number and offset of frames."""

    @property
    def kind(self) -> Kind:
        """Triple for the color, number for the alpha."""
        return "triple" if self.output == "color" else "number"


@dataclass(frozen=True)
class Attribute:
    """An attribute by its name in Blender; without a name the active color attribute."""

    name: str
    output: Literal["color", "vector", "factor", "alpha"] = "color"
    owner: Literal["GEOMETRY", "OBJECT", "INSTANCER", "VIEW_LAYER"] = "GEOMETRY"

    @property
    def kind(self) -> Kind:
        """Number for the factor, which is the mean of the components, and the alpha."""
        return "triple" if self.output in ("color", "vector") else "number"


@dataclass(frozen=True)
class UvMap:
    """A UV map by its name in Blender, z 0; without a name the one that renders."""

    name: str = ""
    kind: Kind = "triple"


@dataclass(frozen=True)
class Coordinate:
    """A property of the shaded point, of the Texture Coordinate and Geometry nodes.

    generated: 0 to 1 in the undeformed mesh's bounding box. object: in the space of `owner`, or of the shaded object.
    object_normal: the interpolated normal in the object's space. In the world's space: position, normal (interpolated),
    true_normal (the face's), incoming (towards the viewer), tangent. backfacing: number, 1 on the back.
    """

    name: Literal[
        "generated",
        "object",
        "object_normal",
        "camera",
        "window",
        "reflection",
        "position",
        "normal",
        "true_normal",
        "incoming",
        "tangent",
        "backfacing",
    ]
    owner: str = ""

    @property
    def kind(self) -> Kind:
        """Triple but for backfacing."""
        return "number" if self.name == "backfacing" else "triple"


@dataclass(frozen=True)
class Apply:
    """An operation of OPERATIONS applied to arguments. `label` names the node that it comes from, for messages."""

    operation: str
    arguments: tuple["Expression", ...]
    label: str = field(default="", compare=False)

    @property
    def kind(self) -> Kind:
        """That of the operation, or, of one by components, triple where an argument is."""
        kind = OPERATIONS[self.operation].kind
        return kind or ("triple" if any(argument.kind == "triple" for argument in self.arguments) else "number")


@dataclass(frozen=True)
class Curve:
    """A piecewise linear function of a number through `points` (x, y) of growing x, constant outside them or, extended, straight.

    With `is_stepped` y is constant from each point to the next. Cycles has color ramps and curves as tables of 256 entries.
    """

    points: tuple[tuple[float, float], ...]
    argument: "Expression"
    is_stepped: bool = False
    is_extended: bool = False
    label: str = field(default="", compare=False)
    kind: Kind = "number"


@dataclass(frozen=True)
class NormalMap:
    """A normal in the world's space from a `color` in [0, 1]; tangents are those of `uv_map`, if empty of the rendered one."""

    color: "Expression"
    strength: "Expression" = Constant(1.0)
    space: Literal["TANGENT", "OBJECT", "WORLD", "BLENDER_OBJECT", "BLENDER_WORLD"] = "TANGENT"
    uv_map: str = ""
    convention: Literal["OPENGL", "DIRECTX"] = "OPENGL"
    kind: Kind = "triple"


@dataclass(frozen=True)
class Bump:
    """A normal in the world's space, from the `normal` (None: the surface's own) and the slope of `height` times `distance`."""

    height: "Expression"
    strength: "Expression" = Constant(1.0)
    distance: "Expression" = Constant(1.0)
    filter_width: float = 0.1
    """Of the finite differences, in pixels."""
    is_inverted: bool = False
    normal: "Expression | None" = None
    kind: Kind = "triple"


type Expression = Constant | ImageTexture | Attribute | UvMap | Coordinate | Apply | Curve | NormalMap | Bump


class Point(Protocol):
    """What `evaluate` needs to know of a shaded point; each method raises LookupError for what it lacks."""

    def uv(self, name: str) -> Triple: ...
    def attribute(self, attribute: Attribute) -> Value: ...
    def coordinate(self, coordinate: Coordinate) -> Value: ...
    def image(self, texture: ImageTexture, coordinates: Triple) -> Value: ...
    def normal_map(self, normal_map: NormalMap, color: Triple, strength: float) -> Triple: ...
    def bump(
        self, bump: Bump, height: Callable[["Point"], float], strength: float, distance: float, normal: Triple | None
    ) -> Triple: ...


def apply(operation: str, *arguments: Expression | Value, label: str = "") -> Expression:
    """Return `operation` of `arguments`, as a constant where all are, and without what changes nothing: + 0, x 1, a full mix."""
    given = tuple(argument if not isinstance(argument, (float, int, tuple)) else Constant(argument) for argument in arguments)
    constants = [argument.value for argument in given if isinstance(argument, Constant)]
    if len(constants) == len(given) and OPERATIONS[operation].python:
        return Constant(compute(operation, *constants))
    match operation, given:
        case ("add", (Constant(0.0 | 0 | (0.0, 0.0, 0.0)), other)) | ("multiply", (Constant(1.0 | 1 | (1.0, 1.0, 1.0)), other)):
            if other.kind == "triple" or given[0].kind == "number":
                return other
        case ("add" | "subtract", (other, Constant(0.0 | 0 | (0.0, 0.0, 0.0)))) | (
            "multiply" | "divide",
            (other, Constant(1.0 | 1 | (1.0, 1.0, 1.0))),
        ):
            if other.kind == "triple" or given[1].kind == "number":
                return other
        case "mix", (first, second, Constant(0.0 | 0 | 1.0 | 1 as factor)):
            return second if factor else first
    return Apply(operation, given, label)


def compute(operation: str, *values: Value) -> Value:
    """Return the reference value of an operation. Raises LookupError where it has none without a shaded point."""
    entry = OPERATIONS[operation]
    if entry.python is None:
        raise LookupError(f"{operation} has no reference value")
    return entry.python(*values) if entry.kind else broadcast(entry.python, *values)


def children(expression: Expression) -> tuple[Expression, ...]:
    """Return the expressions that `expression` takes directly."""
    if isinstance(expression, Apply):
        return expression.arguments
    values = (getattr(expression, item.name) for item in fields(expression))
    return tuple(value for value in values if isinstance(value, EXPRESSIONS))


EXPRESSIONS = (Constant, ImageTexture, Attribute, UvMap, Coordinate, Apply, Curve, NormalMap, Bump)


def walk(expression: Expression) -> Iterator[Expression]:
    """Yield `expression` and all below it, each distinct one once, from the sources on."""
    seen: dict[Expression, None] = {}

    def visit(one: Expression) -> Iterator[Expression]:
        if one in seen:
            return
        seen[one] = None
        for child in children(one):
            yield from visit(child)
        yield one

    return visit(expression)


def as_kind(expression: Expression, kind: Kind, is_color: bool = True) -> Expression:
    """Return `expression` as a number or a triple, converted as Blender does: a color by its luminance, a vector by its mean."""
    if expression.kind == kind:
        return expression
    if kind == "triple":
        return apply("combine", expression, expression, expression)
    return apply("luminance" if is_color else "average", expression)


def evaluate(expression: Expression, point: Point) -> Value:
    """Return the value at `point`; raises LookupError where the point or an operation lacks it."""
    match expression:
        case Constant(value):
            return value
        case ImageTexture():
            return point.image(expression, triple(evaluate(expression.coordinates, point)))
        case Attribute():
            return point.attribute(expression)
        case UvMap(name):
            return point.uv(name)
        case Coordinate():
            return point.coordinate(expression)
        case Apply(operation, arguments):
            return compute(operation, *(evaluate(argument, point) for argument in arguments))
        case Curve():
            return curve_value(expression, number(evaluate(expression.argument, point)))
        case NormalMap():
            return point.normal_map(
                expression, triple(evaluate(expression.color, point)), number(evaluate(expression.strength, point))
            )
        case Bump(height, strength, distance, _, _, normal):
            return point.bump(
                expression,
                lambda other: number(evaluate(height, other)),
                number(evaluate(strength, point)),
                number(evaluate(distance, point)),
                triple(evaluate(normal, point)) if normal else None,
            )


def curve_value(curve: Curve, x: float) -> float:
    """Return the value of `curve` at `x`."""
    points = curve.points
    if curve.is_stepped:
        return next((y for left, y in reversed(points) if x >= left), points[0][1])
    if not curve.is_extended:
        x = min(max(x, points[0][0]), points[-1][0])
    if len(points) == 1:
        return points[0][1]
    index = next((i for i in range(1, len(points) - 1) if x < points[i][0]), len(points) - 1)
    (x0, y0), (x1, y1) = points[index - 1 : index + 1]
    return y0 + (y1 - y0) * (x - x0) / (x1 - x0)


def number(value: Value) -> float:
    """Return a value that is a number; raises TypeError for a triple."""
    if isinstance(value, tuple):
        raise TypeError(f"{value!r} is not a number")
    return float(value)


def triple(value: Value) -> Triple:
    """Return a value as a triple, a number three times."""
    return value if isinstance(value, tuple) else (value, value, value)
