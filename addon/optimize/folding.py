# SPDX-License-Identifier: GPL-3.0-or-later
"""Constant folding and dead code elimination for node groups: a graph specialized for one use of a group.

A group's own `build` function runs in it. A value is a `Constant`, or a `LazyValue` whose node is created only when an output of
the group needs it. A closure too dark to be seen is a `NullClosure`.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy

import bpy

from ..nodes.chosen_lights import COUNT, LIGHTS, SLOTS
from ..nodes.graph import NORMAL, Graph, Group, Operand, Socket, Value
from . import arithmetic
from .arithmetic import Plain
from .usage import Use

SCALAR, VECTOR = "ShaderNodeMath", "ShaderNodeVectorMath"
VECTOR_OUTPUTS = {"Vector", "Color"}
VECTOR_SOCKETS = {"NodeSocketVector", "NodeSocketColor"}
ZERO = (0.0, 0.0, 0.0)


class Constant(Value):
    """A number or vector that is constant."""

    def __init__(self, graph: Graph, value: Plain) -> None:
        self.graph = graph
        self.value = value

    @property
    def is_vector(self) -> bool:
        return isinstance(self.value, tuple)


class Entry(Value):
    """The chosen entry of a menu; `menu` is the group's input that chooses it, None where the code of a group does."""

    def __init__(self, graph: Graph, entry: str, menu: Socket | None = None) -> None:
        self.graph, self.entry, self.menu = graph, entry, menu


class NullClosure(Value):
    """A closure too dark to be seen."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph


class LazyValue(Value):
    """A value whose node is created by `create` when its socket is first needed."""

    def __init__(self, graph: Graph, create: Callable[[], Value], is_vector: bool) -> None:
        self.graph = graph
        self._create = create
        self._is_vector = is_vector
        self._value: Value | None = None

    @property
    def socket(self) -> bpy.types.NodeSocket:
        if self._value is None:
            self._value = self._create()
        return self._value.socket

    @property
    def is_vector(self) -> bool:
        return self._is_vector


class ConstantFoldingGraph(Graph):
    """Fills `tree` with the nodes that a group needs for one `use`, and no others."""

    def __init__(self, tree: bpy.types.ShaderNodeTree, use: Use) -> None:
        super().__init__(tree)
        self._use = use
        self._arguments: Mapping[str, Value] | None = None  # of a group that is built in place
        self._outer = self
        self._menus: dict[Socket, Sequence[tuple[str, str, Operand]]] = {}
        self._lights: dict[str, Value] = {}  # outputs of the group of the chosen lights, once it is needed
        self._shared: dict[object, Value] = {}  # by what they compute; common to all groups built in place

    # Constants

    def plain(self, value: Operand) -> Operand:
        """Return the number or vector of a constant, and any other `value` unchanged; a color without alpha."""
        if isinstance(value, Constant):
            return value.value
        return value[:3] if isinstance(value, tuple) else value

    def value(self, value: Operand) -> Value:
        return value if isinstance(value, Value) else Constant(self, value)

    def known(self, value: Operand) -> Plain | None:
        value = self.plain(value)
        return None if isinstance(value, Value) else value

    def all_known(self, *values: Operand) -> list[Plain] | None:
        """Return the numbers and vectors of `values` where all are constant, else None."""
        known = [value for value in map(self.known, values) if value is not None]
        return known if len(known) == len(values) else None

    def is_all(self, value: Operand, number: float) -> bool:
        """Return whether `value`, or each component of it, is constant and equal to `number`."""
        known = self.known(value)
        return known is not None and all(component == number for component in arithmetic.spread(known))

    def negligible(self, value: Operand) -> bool:
        """Return whether a color or weight was folded to 0; plain numbers never are."""
        return isinstance(value, Constant) and self.is_all(value, 0.0)

    def input(self, socket: Socket) -> Value:
        if self._arguments is None:
            return self._own_input(socket)
        argument = self._arguments.get(socket.name)
        if argument is None and isinstance(socket.default, (float, tuple)):
            argument = self.value(self.plain(socket.default))
        if isinstance(argument, Constant) and socket.kind in VECTOR_SOCKETS:
            argument = Constant(self, arithmetic.spread(argument.value))
        if argument is None:
            raise TypeError(f"{socket.name} has neither an argument nor a default")
        return argument

    def _own_input(self, socket: Socket) -> Value:
        known = self._use.inputs.get(socket.name)
        if socket == NORMAL and known != ZERO:  # Cycles' OSL would ignore a constant and use the surface's own normal
            known = None
        if known is None:
            return self._once(("input", socket.name), lambda: Graph.input(self, socket), socket.kind in VECTOR_SOCKETS)
        if isinstance(known, str):
            return Entry(self, known, socket)
        return Constant(self, known)

    def in_eevee(self) -> Value:
        return self._once("in_eevee", lambda: Graph.in_eevee(self), False)

    def uses_osl(self) -> Value:
        return self._once("uses_osl", lambda: Graph.uses_osl(self), False)

    def meter(self) -> Value:
        return self._once("meter", lambda: Graph.meter(self), False)

    def _lazy(self, create: Callable[[], Value], is_vector: bool) -> Value:
        return LazyValue(self, create, is_vector)

    def _once(self, key: object, create: Callable[[], Value], is_vector: bool) -> Value:
        if key not in self._shared:
            self._shared[key] = self._lazy(create, is_vector)
        return self._shared[key]

    # Arithmetic

    def link(self, source: Operand | str, target: bpy.types.NodeSocket) -> None:
        if isinstance(source, NullClosure):
            return
        if not isinstance(source, str):
            source = self.plain(source)
        if isinstance(source, tuple) and target.type == "RGBA":
            source = (*source, 1.0)
        elif isinstance(source, float) and target.type == "INT":
            source = int(source)
        elif isinstance(source, float) and target.type == "BOOLEAN":
            source = bool(source)
        super().link(source, target)

    def node(self, kind: str, inputs: Mapping[int | str, Operand], output: int | str = 0, **properties: object) -> Value:
        known = self.all_known(*inputs.values()) if kind in (SCALAR, VECTOR) else None
        if known is not None:
            compute = arithmetic.vector if kind == VECTOR else arithmetic.scalar
            return Constant(self, compute(str(properties["operation"]), *known))
        is_vector = output in VECTOR_OUTPUTS or kind == "ShaderNodeCombineXYZ"
        return self._lazy(lambda: Graph.node(self, kind, inputs, output, **properties), is_vector)

    def calculate(self, operation: str, a: Operand, b: Operand) -> Value:
        vectors = [isinstance(x, tuple) or (isinstance(x, Value) and x.is_vector) for x in (a, b)]
        known = self.all_known(a, b)
        if known is not None:
            return Constant(self, (arithmetic.vector if any(vectors) else arithmetic.scalar)(operation, *known))
        zero, one = ([self.is_all(x, number) for x in (a, b)] for number in (0.0, 1.0))
        if (operation == "MULTIPLY" and any(zero)) or (operation == "DIVIDE" and zero[0]):
            return Constant(self, ZERO if any(vectors) else 0.0)
        # operands that change nothing, where the other one has the type of the result
        neutral = {"ADD": zero, "SUBTRACT": [False, zero[1]], "MULTIPLY": one, "DIVIDE": [False, one[1]]}
        for is_neutral, other, is_vector in zip(neutral.get(operation, [False] * 2), (b, a), reversed(vectors), strict=True):
            if is_neutral and isinstance(other, Value) and is_vector == any(vectors):
                return other
        return super().calculate(operation, self.plain(a), self.plain(b))

    def scale(self, vector: Operand, factor: Operand) -> Value:
        known = self.all_known(vector, factor)
        if known is not None:
            return Constant(self, arithmetic.vector("MULTIPLY", *known))
        if self.is_all(vector, 0.0) or self.is_all(factor, 0.0):
            return Constant(self, ZERO)
        return super().scale(vector, factor)

    def multiply_add(self, a: Operand, b: Operand, c: Operand) -> Value:
        trivial = any(self.is_all(x, number) for x in (a, b) for number in (0.0, 1.0))
        if trivial or self.is_all(c, 0.0) or self.all_known(a, b) is not None:
            return self.calculate("ADD", self.calculate("MULTIPLY", a, b), c)
        return super().multiply_add(self.plain(a), self.plain(b), self.plain(c))

    def vector(self, x: Operand, y: Operand, z: Operand) -> Value:
        known = self.all_known(x, y, z)
        if known is None:
            return super().vector(x, y, z)
        return Constant(self, tuple(component for component in known if isinstance(component, float)))

    def separate(self, vector: Value) -> tuple[Value, ...]:
        known = self.known(vector)
        if isinstance(known, tuple):
            return tuple(Constant(self, component) for component in known)
        return self._outputs(lambda: dict(enumerate(Graph.separate(self, vector))), dict.fromkeys(range(3), False))

    def geometry(self, output: str) -> Value:
        return self._once(("geometry", output), lambda: Graph.geometry(self._outer, output), True)

    def mix(self, factor: Operand, first: Operand, second: Operand) -> Value:
        known = self.known(factor)
        if known in (0.0, 1.0):
            return self.value(self.plain(second if known else first))
        return self._lazy(lambda: Graph.mix(self, factor, first, second), True)

    # Closures

    def diffuse(self, color: Operand, normal: Value, roughness: Operand = 0.0, share: float = 1.0) -> Value:
        if self.negligible(color):
            return NullClosure(self)
        key = (*map(_identity, map(self.plain, (color, normal, roughness))), share)
        if key not in self._shared:
            self._shared[key] = super().diffuse(color, normal, roughness, share)
        return self._shared[key]

    def subsurface(
        self, falloff: str, color: Operand, radius: Operand, scale: Operand, normal: Value, ior: float | None = None
    ) -> Value:
        return NullClosure(self) if self.negligible(color) else super().subsurface(falloff, color, radius, scale, normal, ior)

    def beckmann(self, color: Operand, roughness: Operand, normal: Value) -> Value:
        return NullClosure(self) if self.negligible(color) else super().beckmann(color, roughness, normal)

    def emission(self, radiance: Value) -> Value:
        return NullClosure(self) if self.is_all(radiance, 0.0) else super().emission(radiance)

    def shader_to_rgb(self, shader: Value) -> Value:
        return Constant(self, ZERO) if isinstance(shader, NullClosure) else super().shader_to_rgb(shader)

    def add_shader(self, first: Value, *others: Value) -> Value:
        visible = [shader for shader in (first, *others) if not isinstance(shader, NullClosure)]
        return super().add_shader(*visible) if visible else first

    def mix_shader(self, factor: Operand, first: Value | None, second: Value) -> Value:
        first = first or NullClosure(self)
        weight = self.known(factor)
        if first is second or weight == 0.0:
            return first
        if weight == 1.0:
            return second
        if isinstance(second, NullClosure):
            return first if isinstance(first, NullClosure) else super().mix_shader(1.0 - self.value(factor), None, first)
        return super().mix_shader(factor, None if isinstance(first, NullClosure) else first, second)

    def script(self, stem: str, **inputs: Operand) -> Value:
        return self._lazy(lambda: Graph.script(self, stem, **inputs), False)

    # Groups and menus

    def group(self, group: Group, **inputs: Operand | str) -> dict[str, Value]:
        """Return the outputs of another group, built in place; the group of the chosen lights stays one for all materials."""
        if group is LIGHTS:
            if not self._lights:
                kinds = {COUNT: False} | {f"{name} {slot}": True for slot in range(1, SLOTS + 1) for name in "LE"}
                outputs = self._outputs(lambda: Graph.group(self, LIGHTS), kinds)
                self._lights.update(zip(kinds, outputs, strict=True))
            return self._lights
        inner = copy(self)
        inner._arguments = {
            name.replace("_", " "): Entry(self, value) if isinstance(value, str) else self.value(self.plain(value))
            for name, value in inputs.items()
        }
        return dict(group.build(inner))

    def _outputs[Key](self, create: Callable[[], Mapping[Key, Value]], are_vectors: Mapping[Key, bool]) -> tuple[Value, ...]:
        """Return outputs of one node, which `create` makes when the first of them is needed."""
        values: dict[Key, Value] = {}

        def output(key: Key) -> Value:
            if not values:
                values.update(create())
            return values[key]

        return tuple(self._lazy(lambda key=key: output(key), is_vector) for key, is_vector in are_vectors.items())

    def menu(self, menu: Value, kind: str, cases: Sequence[tuple[str, str, Operand]]) -> Value:
        if not isinstance(menu, Entry):
            raise TypeError("the menu is linked to a node")
        if menu.menu:
            self._menus[menu.menu] = [(name, description, 0.0) for name, description, _ in cases]
        return self.value({name: value for name, _, value in cases}[menu.entry])

    def switch(self, number: Operand, cases: Mapping[int, Operand]) -> Value:
        known = self.known(number)
        if isinstance(known, float):
            return self.value(self.plain(cases[int(known)]))
        return self._lazy(lambda: Graph.switch(self, number, cases), False)

    def end(self, outputs: Mapping[str, Value]) -> None:
        super().end({name: value for name, value in outputs.items() if not isinstance(value, NullClosure)})
        for socket, entries in self._menus.items():  # a menu has the entries of the node it is linked to
            Graph.menu(self, Graph.input(self, socket), "FLOAT", entries)


def _identity(value: Operand) -> object:
    """Return a key that is equal for operands that compute the same."""
    return id(value) if isinstance(value, Value) else value
