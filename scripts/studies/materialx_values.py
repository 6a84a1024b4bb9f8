# SPDX-License-Identifier: GPL-3.0-or-later
"""How far operations of input nodes are from their reference, in the GLSL that MaterialX generates from what is written for them.

Needs the package MaterialX as materialx_code.py does: Blender's own copy of it must not be imported in the same process.
"""

import inspect
import math
import random
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import MaterialX as mx

from true_diffuse.addon.material.expression import (
    Apply,
    Coordinate,
    Curve,
    Expression,
    apply,
    evaluate,
    triple,
)
from true_diffuse.addon.material.expression import Constant as Value
from true_diffuse.addon.material.operations import OPERATIONS, Triple
from true_diffuse.addon.material.points import Unknown
from true_diffuse.addon.usd.compositions import COLORS
from true_diffuse.addon.usd.expressions import Writer
from true_diffuse.addon.usd.files import Files
from true_diffuse.addon.usd.network import TOKEN, Network, Output
from true_diffuse.scripts.studies import materialx_code

POSITION = Coordinate("position")
X, Y, Z = (Apply(axis, (POSITION,)) for axis in "xyz")
TURNED = Apply("combine", (Y, Z, X))
LARGEST = 1e4  # of a value that is compared
CONSTANTS = (0.0, 1.0, 2.0, 3.0, -1.0, 0.5)
POINTS = ((-1.0, 0.2), (0.0, 0.5), (0.5, 1.0), (0.5, 0.1), (1.0, 0.4), (2.0, 0.3))  # of a curve, with a jump
# Operations of a triple and what else
TRIPLES: Mapping[str, tuple[Expression, ...]] = {
    "combine": (Z, X, Y),
    "fresnel": (X, Apply("add", (Y, Value(1.5)))),
    "face_forward": (POSITION, Value((1.0, 0.0, 0.5)), TURNED),
    **dict.fromkeys(("refract", "rotate_about"), (POSITION, TURNED, Z)),
    **dict.fromkeys(("mix_hue", "mix_saturation", "mix_value", "mix_color"), (POSITION, TURNED, Z)),
    **dict.fromkeys(("dot", "distance", "cross", "project", "reflect", "rotate", "rotate_back"), (POSITION, TURNED)),
}


@dataclass(frozen=True)
class _At(Unknown):
    position: Triple

    def coordinate(self, coordinate: Coordinate) -> Triple:
        return self.position


def cases() -> Iterator[tuple[str, Expression]]:
    """Yield expressions of the position for each operation, by its name; curves are the operation `curve`."""
    for name, operation in OPERATIONS.items():
        if operation.python is None or "(" in name:
            continue
        if operation.kind:
            yield name, Apply(name, TRIPLES.get(name, (POSITION,)))
            continue
        count = 2 if name in ("minimum", "maximum") else len(inspect.signature(operation.python).parameters)
        yield name, Apply(name, (X, Y, Z)[:count])
        yield name, Apply(name, (POSITION, Y, TURNED)[:count])
        if count > 1:
            others = ((constant, 0.7)[: count - 1] for constant in CONSTANTS)
            parts = [apply(name, X, *values) for values in others]
            yield name, Apply("combine", tuple(parts[:3]))
            yield name, Apply("combine", tuple(parts[3:]))
    for is_stepped in (False, True):
        shapes = (Curve(POINTS, axis, is_stepped, is_extended) for axis, is_extended in ((X, False), (Y, True), (Z, False)))
        yield "curve", Apply("combine", tuple(shapes))


def positions(seed: int) -> list[Triple]:
    """Return points as 32-bit floats: half of them within the unit cube, and some special ones."""
    dice = random.Random(seed)
    spread = [tuple(dice.uniform(-2.5, 2.5) for _ in range(3)) for _ in range(64)]
    inside = [tuple(dice.uniform(0.0, 1.0) for _ in range(3)) for _ in range(57)]
    special = [(0.0, 0.0, 0.0), (1.0, 0.0, 1.0), (0.0, 1.0, 0.0), (2.0, 2.0, 2.0), (-1.0, 2.0, 2.0), (0.25,) * 3, (3.0, -2.0, 0.5)]
    return [struct.unpack("3f", struct.pack("3f", *point)) for point in (*spread, *inside, *special)]


def errors(seed: int = 3) -> dict[str, float]:
    """Return the largest error of each operation, of values above 1 relative, infinite where the shader gives no number.

    Operations on colors are tried on colors from 0 to 1 alone. Raises moderngl.Error where there is no driver.
    """
    standard, points = materialx_code.library(), positions(seed)
    found: dict[str, float] = {}
    for name, expression in cases():
        made = values(expression, points, standard)
        worst = 0.0
        for point, value in zip(points, made, strict=True):
            if name in COLORS and not all(0.0 <= channel <= 1.0 for channel in point):
                continue
            for exact, own in zip(triple(evaluate(expression, _At(point))), value, strict=True):
                if abs(exact) < LARGEST:
                    off = abs(own - exact) / max(1.0, abs(exact))
                    worst = max(worst, off if math.isfinite(off) else math.inf)
        found[name] = max(found.get(name, 0.0), worst)
    return found


def values(expression: Expression, points: Sequence[Triple], standard: mx.Document) -> list[Triple]:
    """Return the color that generated GLSL gives at each of the points."""
    network = Network("Value_")
    color = Writer(network, Files()).color(expression).value
    network.add("surface", "ND_surface_unlit", TOKEN, emission_color=color)
    code = materialx_code.generate(document(network, standard), "GLSL").getSourceCode("pixel")
    return materialx_code.evaluate(code, (0.0, 0.0, 1.0), [((0.0, 0.0, 1.0), (-x, -y, -z)) for x, y, z in points])


def document(network: Network, standard: mx.Document) -> mx.Document:
    """Return a network as a document that includes the `standard` libraries. Raises KeyError for what they lack."""
    made = mx.createDocument()
    made.importLibrary(standard)
    for name, shader in network.shaders.items():
        definition = made.getNodeDef(shader.identifier)
        if definition is None:
            raise KeyError(shader.identifier)
        node = made.addNode(definition.getNodeString(), name, definition.getType())
        node.setNodeDefString(definition.getName())
        for key, value in shader.inputs.items():
            declared = definition.getInput(key)
            if declared is None:
                raise KeyError(f"{shader.identifier}.{key}")
            socket = node.addInput(key, declared.getType())
            if isinstance(value, Output):
                socket.setNodeName(value.shader)
            else:
                socket.setValueString(materialx_code.text_of(value[1]))
    made.addMaterialNode(materialx_code.MATERIAL, made.getNode(list(network.shaders)[-1]))
    return made
