# SPDX-License-Identifier: GPL-3.0-or-later
"""What feeds an input of a surface, as a typed tree of plain values that all targets read. No bpy.

An expression is a number or a triple (a color, linear Rec. 709, or a vector). `read_nodes.py` makes expressions of Blender's nodes;
`operations.py` says what each operation computes and its GLSL. `evaluate` is the reference: what Cycles computes.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields, replace
from functools import cached_property
from typing import Literal, Protocol

from .operations import OPERATIONS, Kind, Triple, Value, broadcast
from .sky import Sky


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

    Blender multiplies the color by the alpha, unless the node's Alpha is used, too (`is_unassociated`): so has an image of the
    alpha mode PREMUL it in its file, and the color is divided by the alpha where it must not; that of a STRAIGHT one is multiplied
    where it must, by EEVEE as linear values, by Cycles as encoded ones if the image has 8 bits. CHANNEL_PACKED, NONE and data are
    taken as they are.
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
    is_cyclic: bool = False
    """Whether the frames of a sequence or movie repeat."""

    @property
    def kind(self) -> Kind:
        """Triple for the color, number for the alpha."""
        return "triple" if self.output == "color" else "number"


@dataclass(frozen=True)
class Attribute:
    """An attribute by its name in Blender; without a name the color attribute that renders.

    The color of a number is gray, the alpha of what is no color is 1. An attribute that the mesh lacks is black.
    """

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
    object_normal: the interpolated normal in the object's space. In the world's space: position, normal (interpolated) and
    true_normal (the face's), both on the viewer's side, incoming (towards the viewer), tangent. backfacing: number, 1 on the back.
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
    """An operation of OPERATIONS applied to arguments. `label` names the node that it comes from, for messages.

    Kind and hash are kept, as arguments that several operations share would else be visited once for each path to them.
    """

    operation: str
    arguments: tuple["Expression", ...]
    label: str = field(default="", compare=False)

    @cached_property
    def kind(self) -> Kind:
        """That of the operation, or, of one by components, triple where an argument is."""
        return OPERATIONS[self.operation].kind or _broadcast_kind(self.arguments)

    @cached_property
    def _hash(self) -> int:
        return hash((self.operation, self.arguments))

    def __hash__(self) -> int:
        return self._hash


@dataclass(frozen=True)
class Curve:
    """A piecewise linear function of a number through `points` (x, y) of growing x, constant outside them or, extended, straight.

    With `is_stepped` y is constant from each point to the next. Cycles has color ramps and curves as tables of 256 intervals.
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


@dataclass(frozen=True)
class SkyTexture:
    """The color of a sky towards `direction`, which Blender takes at any length. `evaluate` has no value for it."""

    sky: Sky
    direction: "Expression"
    label: str = field(default="", compare=False)
    kind: Kind = "triple"


type Expression = Constant | ImageTexture | Attribute | UvMap | Coordinate | Apply | Curve | NormalMap | Bump | SkyTexture


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
    """Return `operation` of `arguments`: a constant where all are, and without what does not change the value.

    Sums and products have their constant last, and differences and quotients with a constant become such.
    """
    given = tuple(argument if not isinstance(argument, (float, int, tuple)) else Constant(argument) for argument in arguments)
    constants = [argument.value for argument in given if isinstance(argument, Constant)]
    if len(constants) == len(given):
        return Constant(compute(operation, *constants))
    simple = _simplified(operation, given, label)
    if simple is None:
        return Apply(operation, given, label)
    if not OPERATIONS[operation].kind and simple.kind == "number" and _broadcast_kind(given) == "triple":
        return as_kind(simple, "triple")
    return simple


def _broadcast_kind(arguments: Iterable[Expression]) -> Kind:
    return "triple" if any(argument.kind == "triple" for argument in arguments) else "number"


def _simplified(operation: str, arguments: tuple[Expression, ...], label: str) -> Expression | None:
    """Return an expression of the same value with fewer operations, None where there is none.

    One of an operation by components may be a number where the operation gives a triple.
    """
    match operation, arguments:
        case "add" | "multiply", (Constant(), other):
            return apply(operation, other, arguments[0], label=label)
        case "subtract", (other, Constant(value)):
            return apply("add", other, broadcast(lambda a: 0.0 - a, value), label=label)
        case "divide", (other, Constant(value)):
            return apply("multiply", other, broadcast(lambda a: 1.0 / a if a else 0.0, value), label=label)
        case ("add", (other, Constant(0 | (0, 0, 0)))) | ("multiply", (other, Constant(1 | (1, 1, 1)))):
            return other
        case "multiply", (_, Constant(0 | (0, 0, 0))):
            return Constant(0.0)
        case "add" | "multiply", (Apply(inner, (other, Constant(first))), Constant(second)) if inner == operation:
            return apply(operation, other, compute(operation, first, second), label=label)
        case "mix", (first, second, Constant(0 | 1 as factor)):
            return second if factor else first
        case "mix", (first, second, _) if first == second:
            return first
        case "clamp", (other, Constant(0), Constant(1)) if _is_unit(other):
            return other
        case (("rotate" | "rotate_back"), (other, Constant((0, 0, 0)))):
            return other
        case (("x" | "y" | "z"), (Apply("combine", components),)):
            return components["xyz".index(operation)]
        case (("luminance" | "average"), (Apply("combine", (first, second, third)),)) if first == second == third:
            return first
        case "combine", (Apply("x", (first,)), Apply("y", (second,)), Apply("z", (third,))) if first == second == third:
            return first
    return None


def _is_unit(expression: Expression) -> bool:
    """Return whether the value is known to be within 0 and 1, which is worth asking of images alone."""
    match expression:
        case ImageTexture():
            return not expression.image.is_float and expression.interpolation in ("Linear", "Closest")
        case Apply("x" | "y" | "z" | "luminance" | "average", (argument,)):
            return _is_unit(argument)
    return False


def curve(
    points: tuple[tuple[float, float], ...],
    argument: Expression,
    is_stepped: bool = False,
    is_extended: bool = False,
    label: str = "",
) -> Expression:
    """Return the curve through `points` of a number, as a constant, or as the number itself, where it is no more."""
    made = Curve(points, argument, is_stepped, is_extended, label)
    if isinstance(argument, Constant):
        return Constant(curve_value(made, number(argument.value)))
    if all(y == points[0][1] for _, y in points):
        return Constant(points[0][1])
    if is_extended and all(x == y for x, y in points):
        return argument
    return made


def compute(operation: str, *values: Value) -> Value:
    """Return the reference value of an operation; KeyError where there is no such."""
    entry = OPERATIONS[operation]
    return entry.python(*values) if entry.kind else broadcast(entry.python, *values)


def children(expression: Expression) -> tuple[Expression, ...]:
    """Return the expressions that `expression` takes directly."""
    if isinstance(expression, Apply):
        return expression.arguments
    values = (getattr(expression, item.name) for item in fields(expression))
    return tuple(value for value in values if isinstance(value, EXPRESSIONS))


def rewritten(expression: Expression, change: Callable[[Expression], Expression | None]) -> Expression:
    """Return `expression` with what `change` returns in the place of what is in it, from the top; None looks further below."""
    made: dict[int, Expression] = {}  # by identity, so that what several operations share is visited once

    def of(one: Expression) -> Expression:
        if id(one) not in made:
            made[id(one)] = change(one) or _with_children(one, of)
        return made[id(one)]

    return of(expression)


def _with_children(one: Expression, of: Callable[[Expression], Expression]) -> Expression:
    match one:
        case Apply(operation, arguments):
            return apply(operation, *map(of, arguments), label=one.label)
        case Curve():
            return curve(one.points, of(one.argument), one.is_stepped, one.is_extended, one.label)
    below = {item.name: getattr(one, item.name) for item in fields(one)}
    return replace(one, **{name: of(value) for name, value in below.items() if isinstance(value, EXPRESSIONS)})


EXPRESSIONS = (Constant, ImageTexture, Attribute, UvMap, Coordinate, Apply, Curve, NormalMap, Bump, SkyTexture)


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
    """Return the value at `point`; raises LookupError where the point lacks what it needs, and for skies."""
    values: dict[int, Value] = {}  # by identity, so that what several operations share is computed once

    def value(one: Expression) -> Value:
        if id(one) not in values:
            values[id(one)] = _value(one)
        return values[id(one)]

    def _value(one: Expression) -> Value:
        match one:
            case Constant(constant):
                return constant
            case ImageTexture():
                return point.image(one, triple(value(one.coordinates)))
            case Attribute():
                return point.attribute(one)
            case UvMap(name):
                return point.uv(name)
            case Coordinate():
                return point.coordinate(one)
            case Apply(operation, arguments):
                return compute(operation, *(value(argument) for argument in arguments))
            case Curve():
                return curve_value(one, number(value(one.argument)))
            case NormalMap():
                return point.normal_map(one, triple(value(one.color)), number(value(one.strength)))
            case Bump(height, strength, distance, _, _, normal):
                return point.bump(
                    one,
                    lambda other: number(evaluate(height, other)),
                    number(value(strength)),
                    number(value(distance)),
                    triple(value(normal)) if normal else None,
                )
            case SkyTexture():
                raise LookupError("the graphics driver alone computes skies")

    return value(expression)


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
