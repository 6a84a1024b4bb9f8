# SPDX-License-Identifier: GPL-3.0-or-later
"""Arithmetic on the inputs of a network that makes nodes of MaterialX 1.39's standard library. No pxr."""

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from ..material.operations import Value, broadcast
from .network import COLOR, COLOR4, FLOAT, INT, VECTOR2, VECTOR3, VECTOR4, Constant, Input, Network

TYPES = {FLOAT: "float", COLOR: "color3", VECTOR3: "vector3", VECTOR2: "vector2", COLOR4: "color4", VECTOR4: "vector4"}
"""Names in MaterialX of USD's types."""

# Standard nodes: their inputs, and what they compute of constants
NODES: dict[str, tuple[tuple[str, ...], Callable[..., float]]] = {
    "add": (("in1", "in2"), operator.add),
    "subtract": (("in1", "in2"), operator.sub),
    "multiply": (("in1", "in2"), operator.mul),
    "divide": (("in1", "in2"), operator.truediv),
    "modulo": (("in1", "in2"), lambda a, b: a - b * math.floor(a / b)),
    "power": (("in1", "in2"), math.pow),
    "min": (("in1", "in2"), min),
    "max": (("in1", "in2"), max),
    "absval": (("in",), abs),
    "sign": (("in",), lambda a: float((a > 0.0) - (a < 0.0))),
    "floor": (("in",), lambda a: float(math.floor(a))),
    "ceil": (("in",), lambda a: float(math.ceil(a))),
    "fract": (("in",), lambda a: a - math.floor(a)),
    "sqrt": (("in",), math.sqrt),
    "ln": (("in",), math.log),
    "exp": (("in",), math.exp),
    "sin": (("in",), math.sin),
    "cos": (("in",), math.cos),
    "tan": (("in",), math.tan),
    "asin": (("in",), math.asin),
    "acos": (("in",), math.acos),
    "atan2": (("iny", "inx"), math.atan2),
}
COMPARISONS = {"ifgreater": operator.gt, "ifgreatereq": operator.ge, "ifequal": operator.eq}
NEUTRAL = {"add": 0.0, "subtract": 0.0, "multiply": 1.0, "divide": 1.0}  # second values that change nothing


@dataclass(frozen=True, eq=False)
class Term:
    """An input of a network. Arithmetic with other terms or numbers adds nodes; of constants it gives constants."""

    network: Network
    value: Input

    @property
    def type(self) -> str:
        """The type in USD."""
        return self.value.type

    @property
    def constant(self) -> float | None:
        """The value of a number that is constant; None for others."""
        return self.value.value if isinstance(self.value, Constant) and isinstance(self.value.value, float) else None

    def make(self, value: "Term | float", kind: str = FLOAT) -> "Term":
        """Return a number as a constant of a type, a term as it is."""
        return value if isinstance(value, Term) else Term(self.network, constant(value, kind))

    def add_node(self, name: str, identifier: str, kind: str, **inputs: Input) -> "Term":
        """Add any node, and return its output."""
        return Term(self.network, self.network.add(name, identifier, kind, "out", **inputs))

    def node(self, name: str, *others: "Term | float") -> "Term":
        """Return a node of NODES for this and `others`, by components where this or the first of them is a triple."""
        names, compute = NODES[name]
        kind = next((term.type for term in (self, *others) if isinstance(term, Term) and term.type != FLOAT), FLOAT)
        inputs = [self.value, *(self.make(other).value for other in others)]
        known = [value.value for value in inputs if isinstance(value, Constant)]
        if len(known) == len(inputs):
            found = broadcast(compute, *known)  # ty: ignore[invalid-argument-type] - numbers or triples
            return Term(self.network, constant(found, kind))
        if name in NEUTRAL and inputs[0].type == kind and _is(inputs[1], NEUTRAL[name]):
            return self
        if name in ("add", "multiply") and inputs[1].type == kind and _is(inputs[0], NEUTRAL[name]):
            return Term(self.network, inputs[1])
        if name == "multiply" and (_is(inputs[0], 0.0) or _is(inputs[1], 0.0)):
            return Term(self.network, constant(0.0, kind))
        inputs[0] = Term(self.network, inputs[0]).converted(kind).value
        suffix = "FA" if kind != FLOAT and len(inputs) == 2 and inputs[1].type == FLOAT else ""
        return self.add_node(name, f"ND_{name}_{TYPES[kind]}{suffix}", kind, **dict(zip(names, inputs, strict=True)))

    def choice(self, name: str, other: "Term | float", yes: "Term | float", no: "Term | float") -> "Term":
        """Return `yes` where this number compares with `other` as the node `name` says, else `no`."""
        second = self.make(other)
        kind = next((value.type for value in (yes, no) if isinstance(value, Term)), FLOAT)
        first_choice, second_choice = self.make(yes, kind), self.make(no, kind)
        if self.constant is not None and second.constant is not None:
            return first_choice if COMPARISONS[name](self.constant, second.constant) else second_choice
        inputs = {"value1": self.value, "value2": second.value, "in1": first_choice.value, "in2": second_choice.value}
        return self.add_node(name, f"ND_{name}_{TYPES[kind]}", kind, **inputs)

    def converted(self, kind: str) -> "Term":
        """Return this as another type; a number becomes a triple of equal components."""
        if self.type == kind:
            return self
        if isinstance(self.value, Constant):
            return Term(self.network, constant(self.value.value, kind))  # ty: ignore[invalid-argument-type] - a number or triple
        if {self.type, kind} in ({COLOR4, VECTOR3}, {COLOR, VECTOR2}, {COLOR4, VECTOR2}):
            return self.converted(COLOR if self.type == COLOR4 else VECTOR3).converted(kind)
        return self.add_node("convert", f"ND_convert_{TYPES[self.type]}_{TYPES[kind]}", kind, **{"in": self.value})

    def component(self, index: int) -> "Term":
        """Return a component of a triple, vector2 or color4."""
        if isinstance(self.value, Constant) and isinstance(self.value.value, tuple):
            return Term(self.network, Constant(FLOAT, self.value.value[index]))
        inputs = {"in": self.value, "index": Constant(INT, index)}
        return self.add_node("extract", f"ND_extract_{TYPES[self.type]}", FLOAT, **inputs)

    def __add__(self, other: "Term | float") -> "Term":
        return self.node("add", other)

    def __sub__(self, other: "Term | float") -> "Term":
        return self.node("subtract", other)

    def __mul__(self, other: "Term | float") -> "Term":
        return self.node("multiply", other)

    def __truediv__(self, other: "Term | float") -> "Term":
        return self.node("divide", other)

    def __rsub__(self, other: float) -> "Term":
        return self.make(other, self.type).node("subtract", self)

    def __rtruediv__(self, other: float) -> "Term":
        return self.make(other, self.type).node("divide", self)

    def __neg__(self) -> "Term":
        return self * -1.0

    def minimum(self, other: "Term | float") -> "Term":
        """Return the lower."""
        return self.node("min", other)

    def maximum(self, other: "Term | float") -> "Term":
        """Return the higher."""
        return self.node("max", other)

    def clamped(self) -> "Term":
        """Return this within [0, 1]."""
        return self.maximum(0.0).minimum(1.0)

    def above(self, other: "Term | float", yes: "Term | float", no: "Term | float") -> "Term":
        """Return `yes` where this number is higher than `other`, else `no`."""
        return self.choice("ifgreater", other, yes, no)

    def at_least(self, other: "Term | float", yes: "Term | float", no: "Term | float") -> "Term":
        """Return `yes` where this number is not lower than `other`, else `no`."""
        return self.choice("ifgreatereq", other, yes, no)

    def equal(self, other: "Term | float", yes: "Term | float", no: "Term | float") -> "Term":
        """Return `yes` where this number is `other`, else `no`."""
        return self.choice("ifequal", other, yes, no)

    def dot(self, other: "Term") -> "Term":
        """Return the scalar product of two vectors."""
        return self.add_node("dot", "ND_dotproduct_vector3", FLOAT, in1=self.value, in2=other.value)

    def cross(self, other: "Term") -> "Term":
        """Return the vector product of two vectors."""
        return self.add_node("cross", "ND_crossproduct_vector3", VECTOR3, in1=self.value, in2=other.value)

    def length(self) -> "Term":
        """Return the length of a vector."""
        return self.add_node("length", "ND_magnitude_vector3", FLOAT, **{"in": self.value})

    def unit(self) -> "Term":
        """Return the unit vector along a vector, 0 where that is 0."""
        unit = self.add_node("unit", "ND_normalize_vector3", VECTOR3, **{"in": self.value})
        return self.length().above(0.0, unit, 0.0)

    def mixed(self, other: "Term", factor: "Term") -> "Term":
        """Return this at factor 0, `other`, of the same type, at 1."""
        suffix = f"_{TYPES[self.type]}" if factor.type != FLOAT else ""
        inputs = {"bg": self.value, "fg": other.value, "mix": factor.value}
        return self.add_node("mix", f"ND_mix_{TYPES[self.type]}{suffix}", self.type, **inputs)


def constant(value: Value, kind: str) -> Constant:
    """Return a number or triple as a constant of a type; a number becomes a triple of equal components."""
    if kind == FLOAT:
        return Constant(FLOAT, float(value))  # ty: ignore[invalid-argument-type] - a number, as its type says
    values = value if isinstance(value, tuple) else (value,) * 3
    return Constant(kind, tuple(float(component) for component in values[: 2 if kind == VECTOR2 else 3]))


def combined(values: Sequence[Term], kind: str) -> Term:
    """Return the triple of three numbers."""
    numbers = [term.constant for term in values]
    if all(number is not None for number in numbers):
        return Term(values[0].network, Constant(kind, tuple(numbers)))
    first, second, third = (term.value for term in values)
    return values[0].add_node("combine", f"ND_combine3_{TYPES[kind]}", kind, in1=first, in2=second, in3=third)


def _is(value: Input, number: float) -> bool:
    return isinstance(value, Constant) and value.value in (number, (number,) * 3)
