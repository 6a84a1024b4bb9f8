# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions as nodes of MaterialX's standard library. No pxr.

Numbers are float, triples color3 or vector3, as what they feed wants. Each expression is written once.
"""

import re
from collections.abc import Iterable, Sequence
from itertools import pairwise

from ..material import expression as tree
from ..material.expression import Apply, Attribute, Coordinate, Curve, Expression, ImageTexture, NormalMap, UvMap
from ..material.texture_formulas import as_arithmetic, is_fractal
from ..material.textures import FUNCTIONS
from ..models.color import LUMINANCE
from .affine import Step, transformed
from .compositions import BY_TYPE, COLORS, COMPOSITIONS, VECTORS
from .files import Files, Unsupported
from .lookups import color_of
from .network import BOOL, COLOR, COLOR4, FILE, FLOAT, INT, STRING, VECTOR2, VECTOR3, VECTOR4, Constant, Network, Primvar
from .terms import TYPES, Term, combined, constant

# Of attributes, by Blender's names of data types
PLAIN_TYPES = {"FLOAT": FLOAT, "FLOAT_VECTOR": VECTOR3}
COLOR_TYPES = {"FLOAT_COLOR", "BYTE_COLOR"}
ADDRESS_MODES = {"REPEAT": "periodic", "EXTEND": "clamp", "CLIP": "constant", "MIRROR": "mirror"}
FILTERS = {"Linear": "linear", "Closest": "closest", "Cubic": "cubic", "Smart": "cubic"}
MAX_SEGMENTS = 32  # of a curve
TOLERANCES = (1e-4, 5e-4, 2e-3)  # of a curve with fewer points, the first that leaves few enough; the last is half a step of 8 bits


class Writer:
    """Writes expressions into `network`. Raises Unsupported for what MaterialX lacks.

    `expressions` are all that will be asked for: an image of which both color and alpha are among them is looked up once.
    """

    def __init__(self, network: Network, files: Files, expressions: Iterable[Expression] = ()) -> None:
        self.network, self.files = network, files
        self._written: dict[tuple[object, str], Term] = {}
        leaves = (one for expression in expressions for one in tree.walk(expression))
        self._with_alpha = {color_of(one) for one in leaves if isinstance(one, ImageTexture) and one.output == "alpha"}

    def number(self, expression: Expression) -> Term:
        """Return an expression as a float."""
        return self._value(expression, FLOAT)

    def color(self, expression: Expression) -> Term:
        """Return an expression as a color3, a number three times."""
        return self._value(expression, COLOR)

    def vector(self, expression: Expression) -> Term:
        """Return an expression as a vector3, a number three times."""
        return self._value(expression, VECTOR3)

    def _value(self, expression: Expression, kind: str) -> Term:
        if (expression, kind) not in self._written:
            if kind != FLOAT and expression.kind == "number":
                self._written[expression, kind] = self._value(expression, FLOAT).converted(kind)
            else:
                self._written[expression, kind] = self._write(expression, kind)
        return self._written[expression, kind]

    def _write(self, expression: Expression, kind: str) -> Term:
        match expression:
            case tree.Constant(value):
                return Term(self.network, constant(value, kind))
            case ImageTexture():
                return self._image(expression, kind)
            case Attribute():
                return self._attribute(expression, kind)
            case UvMap(name):
                return self._uv_map(name).converted(kind)
            case Coordinate():
                return self._coordinate(expression).converted(kind)
            case Curve():
                return self._curve(expression)
            case NormalMap():
                return self._normal_map(expression).converted(kind)
            case tree.Bump():
                return self._bump(expression).converted(kind)
            case Apply():
                return self._operation(expression, kind)
            case tree.SkyTexture(label=node):
                raise Unsupported(node, "a sky of scattered light")

    def _add(self, name: str, identifier: str, kind: str, **inputs: Constant | Primvar | Term) -> Term:
        values = {key: value.value if isinstance(value, Term) else value for key, value in inputs.items()}
        return Term(self.network, self.network.add(name, identifier, kind, "out", **values))

    # images and attributes

    def _image(self, texture: ImageTexture, kind: str) -> Term:
        """Return a texture: of colors as color3 or color4, which MaterialX transforms, of data as vector3 or vector4."""
        file = self.files[texture.image.name]
        color = color_of(texture)
        is_multiplied = texture.image.alpha_mode == "STRAIGHT" and not texture.is_unassociated and not file.is_opaque
        if texture.output == "color" and color not in self._with_alpha and not is_multiplied:
            return self._lookup(color, VECTOR3 if texture.image.is_data else COLOR).converted(kind)
        both = self._lookup(color, VECTOR4 if texture.image.is_data else COLOR4)
        if texture.output == "alpha":
            return both.component(3)
        if is_multiplied:
            both = self._add("associated", "ND_premult_color4", COLOR4, **{"in": both.converted(COLOR4)})
        return both.converted(kind)

    def _lookup(self, texture: ImageTexture, kind: str) -> Term:
        if (texture, kind) not in self._written:
            check_image(texture)
            file, mode = self.files[texture.image.name], Constant(STRING, ADDRESS_MODES[texture.extension])
            self._written[texture, kind] = self._add(
                f"image_{label(texture.image.name)}",
                f"ND_image_{TYPES[kind]}",
                kind,
                file=Constant(FILE, file.path, file.color_space),
                texcoord=self._place(texture.coordinates),
                uaddressmode=mode,
                vaddressmode=mode,
                filtertype=Constant(STRING, FILTERS[texture.interpolation]),
            )
        return self._written[texture, kind]

    def _place(self, coordinates: Expression) -> Term:
        """Return the coordinates of an image, of type vector2."""
        if (coordinates, VECTOR2) not in self._written:
            found = transformed(coordinates)
            if found is None:
                place = self.vector(coordinates).converted(VECTOR2)
            else:
                place = self._uv_map(found[0])
                for step in found[1]:
                    place = self._moved(place, step)
            self._written[coordinates, VECTOR2] = place
        return self._written[coordinates, VECTOR2]

    def _moved(self, place: Term, step: Step) -> Term:
        """Return coordinates moved by place2d, which divides by its scale, turns clockwise, and subtracts its offset."""
        if 0.0 in step.scale:
            raise Unsupported("", "a Mapping of scale 0")
        (width, height), (x, y) = step.scale, step.translation
        return self._add(
            "placement",
            "ND_place2d_vector2",
            VECTOR2,
            texcoord=place,
            scale=Constant(VECTOR2, (1.0 / width, 1.0 / height)),
            rotate=Constant(FLOAT, -step.rotation),
            offset=Constant(VECTOR2, (-x, -y)),
        )

    def _uv_map(self, name: str) -> Term:
        key = UvMap(name), VECTOR2
        if key not in self._written:
            self._written[key] = self._add("uv", "ND_geompropvalue_vector2", VECTOR2, geomprop=Primvar(name, "uv"))
        return self._written[key]

    def _attribute(self, attribute: Attribute, kind: str) -> Term:
        check_attribute(attribute)
        data_type = self.files.attributes.get(attribute.name, "FLOAT_COLOR")
        if data_type == "FLOAT2" and attribute.kind == "triple":
            return self._uv_map(attribute.name).converted(kind)
        if data_type in PLAIN_TYPES:
            return self._plain_attribute(attribute, PLAIN_TYPES[data_type], kind)
        if data_type not in COLOR_TYPES:
            raise Unsupported("", f"the attribute {attribute.name} of the type {data_type.replace('_', ' ').title()}")
        key = Attribute(attribute.name), COLOR4
        if key not in self._written:
            primvar = Primvar(attribute.name, "color")
            self._written[key] = self._add("attribute", "ND_geompropvalue_color4", COLOR4, geomprop=primvar)
        value = self._written[key]
        if attribute.output == "alpha":
            return value.component(3)
        if attribute.output == "factor":
            return value.converted(VECTOR3).dot(Term(self.network, constant(1.0 / 3.0, VECTOR3)))
        return value.converted(kind)

    def _plain_attribute(self, attribute: Attribute, own: str, kind: str) -> Term:
        """Return an attribute that is no color; its factor is the mean of its components, its alpha 1."""
        if attribute.output == "alpha":
            return Term(self.network, constant(1.0, FLOAT))
        key = Attribute(attribute.name), own
        if key not in self._written:
            primvar = Primvar(attribute.name, "value")
            self._written[key] = self._add("attribute", f"ND_geompropvalue_{TYPES[own]}", own, geomprop=primvar)
        value = self._written[key]
        if attribute.output == "factor" and own == VECTOR3:
            return value.dot(Term(self.network, constant(1.0 / 3.0, VECTOR3)))
        return value.converted(kind)

    def _coordinate(self, coordinate: Coordinate) -> Term:
        world, own = Constant(STRING, "world"), Constant(STRING, "object")
        match coordinate.name:
            case "position":
                return self._add("position", "ND_position_vector3", VECTOR3, space=world)
            case "object" if not coordinate.owner:
                return self._add("position", "ND_position_vector3", VECTOR3, space=own)
            case "normal":
                return self._add("normal", "ND_normal_vector3", VECTOR3, space=world)
            case "object_normal":
                return self._add("normal", "ND_normal_vector3", VECTOR3, space=own)
            case "tangent":
                return self._add("tangent", "ND_tangent_vector3", VECTOR3, space=world)
            case "incoming":
                return -self._add("view", "ND_viewdirection_vector3", VECTOR3, space=world)
        raise Unsupported("", f"the coordinate {coordinate.name.replace('_', ' ').title()}")

    # normals

    def _normal_map(self, normal_map: NormalMap) -> Term:
        """Return the normal. In tangent space Cycles scales x and y by the strength, and takes z to 1 below strength 1."""
        strength, color = self.number(normal_map.strength).maximum(0.0), self.vector(normal_map.color)
        if normal_map.space == "TANGENT":
            if strength.minimum(1.0).constant != 1.0:
                flat = Term(self.network, Constant(VECTOR3, (0.5, 0.5, 1.0)))
                color = flat.mixed(color, strength.minimum(1.0))
            beyond = strength.maximum(1.0)
            if normal_map.convention == "DIRECTX":
                return self._add("normal_map", "ND_normalmap_vector2", VECTOR3, scale=pair(beyond, -beyond), **{"in": color})
            scale = {} if beyond.constant == 1.0 else {"scale": beyond}
            return self._add("normal_map", "ND_normalmap_float", VECTOR3, **scale, **{"in": color})
        signs = (2.0, -2.0, -2.0) if normal_map.space.startswith("BLENDER") else (2.0, 2.0, 2.0)
        normal = (color - 0.5) * Term(self.network, Constant(VECTOR3, signs))
        if normal_map.space.endswith("OBJECT"):
            spaces = {"fromspace": Constant(STRING, "object"), "tospace": Constant(STRING, "world")}
            normal = self._add("world", "ND_transformnormal_vector3", VECTOR3, **spaces, **{"in": normal})
        if strength.constant == 1.0:
            return normal.unit()
        return self.vector(Coordinate("normal")).mixed(normal.unit(), strength).unit()

    def _bump(self, bump: tree.Bump) -> Term:
        """Return MaterialX's bump. Its slope is the height's over that of the UV map, by 1/16, rather than over lengths."""
        height = self.number(bump.height) * self.number(bump.distance)
        inputs = {"height": -height if bump.is_inverted else height, "scale": self.number(bump.strength)}
        if bump.normal:
            inputs["normal"] = self.vector(bump.normal)
        return self._add("bump", "ND_bump_vector3", VECTOR3, **inputs)

    # operations

    def _operation(self, expression: Apply, kind: str) -> Term:
        name, arguments = expression.operation, expression.arguments
        try:
            if is_fractal(expression):
                return self._fractal(expression)
            if formula := as_arithmetic(expression):
                return self._value(formula, kind)
            if name in BY_TYPE:
                return BY_TYPE[name](*(self._value(one, kind if one.kind == "triple" else FLOAT) for one in arguments))
            if name in VECTORS or name in COLORS:
                table, triple = (VECTORS, VECTOR3) if name in VECTORS else (COLORS, COLOR)
                terms = (self._value(one, triple if one.kind == "triple" else FLOAT) for one in arguments)
                return table[name](*terms).converted(kind)
            if name == "combine":
                return combined([self.number(one) for one in arguments], kind)
            if name in ("x", "y", "z"):
                return self._own(arguments[0]).component("xyz".index(name))
            if name in ("luminance", "average"):
                weights = LUMINANCE if name == "luminance" else (1.0 / 3.0,) * 3
                return self.vector(arguments[0]).dot(Term(self.network, Constant(VECTOR3, weights)))
            return self._by_components(expression, kind)
        except Unsupported as problem:
            raise Unsupported(problem.node or expression.label, problem.what) from problem

    def _fractal(self, noise: Apply) -> Term:
        vector, _, _, detail, roughness, lacunarity, *_ = noise.arguments
        octaves = Constant(INT, int(self.number(detail).constant or 0.0) + 1)
        inputs = {"octaves": octaves, "lacunarity": self.number(lacunarity), "diminish": self.number(roughness)}
        place = self.vector(vector)
        if "2D" in noise.operation:
            return self._add("noise", "ND_fractal2d_float", FLOAT, texcoord=place.converted(VECTOR2), **inputs)
        return self._add("noise", "ND_fractal3d_float", FLOAT, position=place, **inputs)

    def _own(self, expression: Expression) -> Term:
        """Return a triple in the type that it is written in already, or that comes without a conversion."""
        match expression:
            case ImageTexture():
                is_color = not expression.image.is_data
            case Apply(operation):
                is_color = operation in COLORS or operation in BY_TYPE
            case _:
                is_color = isinstance(expression, Attribute)
        kinds = [kind for kind in (COLOR, VECTOR3) if (expression, kind) in self._written]
        return self._value(expression, kinds[0] if kinds else COLOR if is_color else VECTOR3)

    def _by_components(self, expression: Apply, kind: str) -> Term:
        """Return an operation whose composition is of floats."""
        compose = COMPOSITIONS.get(expression.operation)
        if compose is None:
            noun = "texture" if expression.operation.partition("(")[0] in FUNCTIONS else "operation"
            raise Unsupported(expression.label, f"the {noun} {expression.operation.partition('(')[0].replace('_', ' ')}")
        values = [self.number(one) if one.kind == "number" else self._own(one) for one in expression.arguments]
        if kind == FLOAT:
            return compose(*values)
        return combined(
            [compose(*(one if one.type == FLOAT else one.component(index) for one in values)) for index in range(3)], kind
        )

    def _curve(self, curve: Curve) -> Term:
        """Return the sum of what each segment of a curve adds."""
        points = curve.points
        for tolerance in () if curve.is_stepped else TOLERANCES:
            points = simplified(curve.points, tolerance)
            if len(points) <= MAX_SEGMENTS + 1:
                break
        if len(points) > MAX_SEGMENTS + 1:
            raise Unsupported(curve.label, f"a curve of {len(points)} points")
        x = self.number(curve.argument)
        total, last = x.make(points[0][1]), len(points) - 2
        for index, ((x0, y0), (x1, y1)) in enumerate(pairwise(points)):
            if y0 == y1:
                continue
            if curve.is_stepped or x0 == x1:
                total = x.at_least(x1, y1 - y0, 0.0) + total
                continue
            if curve.is_extended and index in (0, last):
                part = (x - x0) * ((y1 - y0) / (x1 - x0))
                if index != 0:
                    part = part.minimum(0.0) if y1 < y0 else part.maximum(0.0)
                if index != last:
                    part = part.maximum(y1 - y0) if y1 < y0 else part.minimum(y1 - y0)
            else:
                part = self._segment(x, x0, x1, y1 - y0)
            total = part + total
        return total

    def _segment(self, x: Term, start: float, end: float, rise: float) -> Term:
        """Return a line from 0 at `start` to `rise` at `end`, constant outside. The node wants its lower output first."""
        ends = {"inlow": start, "inhigh": end, "outlow": 0.0, "outhigh": rise}
        if rise < 0.0:
            ends = {"inlow": end, "inhigh": start, "outlow": rise, "outhigh": 0.0}
        inputs = {name: Constant(FLOAT, value) for name, value in ends.items()}
        return self._add("segment", "ND_range_float", FLOAT, **inputs, doclamp=Constant(BOOL, True), **{"in": x})


def check_image(texture: ImageTexture) -> None:
    """Raise Unsupported for an image that USD cannot hold."""
    if texture.projection != "FLAT":
        raise Unsupported("", f"the projection {texture.projection.title()} of the image {texture.image.name}")
    if texture.image.source in ("SEQUENCE", "MOVIE", "VIEWER"):
        raise Unsupported("", f"the {texture.image.source.lower()} {texture.image.name}")


def check_attribute(attribute: Attribute) -> None:
    """Raise Unsupported for an attribute that is not a mesh's."""
    if attribute.owner != "GEOMETRY":
        raise Unsupported("", f"the attribute {attribute.name} of the {attribute.owner.lower().replace('_', ' ')}")


def label(name: str) -> str:
    """Return the file's part of an image's full name without its suffix, as letters, digits and underscores."""
    return re.sub(r"\W", "_", name.rpartition("/")[2].rpartition(".")[0] or name, flags=re.ASCII)


def pair(first: Term, second: Term) -> Term:
    """Return two numbers as a vector2."""
    if first.constant is not None and second.constant is not None:
        return Term(first.network, Constant(VECTOR2, (first.constant, second.constant)))
    return first.add_node("pair", "ND_combine2_vector2", VECTOR2, in1=first.value, in2=second.value)


def simplified(points: Sequence[tuple[float, float]], tolerance: float) -> list[tuple[float, float]]:
    """Return the points of a curve but those that straight lines replace to within `tolerance` (Ramer, Douglas, Peucker)."""
    if len(points) < 3:
        return list(points)
    (x0, y0), (x1, y1) = points[0], points[-1]
    off = [abs(y - y0 - (y1 - y0) * (x - x0) / (x1 - x0)) if x1 > x0 else abs(y - y0) for x, y in points[1:-1]]
    worst = max(range(len(off)), key=off.__getitem__) + 1
    if off[worst - 1] <= tolerance:
        return [points[0], points[-1]]
    return [*simplified(points[: worst + 1], tolerance)[:-1], *simplified(points[worst:], tolerance)]
