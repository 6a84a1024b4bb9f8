# SPDX-License-Identifier: GPL-3.0-or-later
"""A graph for one use of a group: it works out what is known ahead, and makes only the nodes that reach the group's outputs.

The groups' own `build` functions run in it. A value is `Constant`, known ahead, or `Later`: a node that is made when something
that is made needs it. A closure that is too dark to be seen is `Nothing`.
"""

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field

import bpy

from ..nodes.chosen_lights import LIGHTS, SLOTS
from ..nodes.graph import NORMAL, Graph, Group, Operand, Socket, Value
from ..nodes.subsurface import MEAN_FREE_PATH
from . import arithmetic
from .arithmetic import Plain

LEAST = 1e-4  # of what a white surface lit head on reflects: a lobe below it is left out
SCALAR, VECTOR = "ShaderNodeMath", "ShaderNodeVectorMath"
VECTOR_OUTPUTS = {"Vector", "Color"}
WIDE = {"NodeSocketVector", "NodeSocketColor"}
DARK = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Use:
    """What is known ahead of one use of a group.

    `inputs` has the sockets that nothing feeds, colors without alpha. The rest is None where the scenes that use it differ.
    """

    inputs: Mapping[str, Plain | str]
    eevee: bool | None = None
    osl: bool | None = None
    meter: float | None = None
    """How many of the scene's units a meter has."""
    shining: tuple[bool, ...] = field(default=(True,) * SLOTS)
    """Which of the chosen lamps' slots hold a light that shines."""
    flat: bool = False
    """Whether light comes out of the matter so near to where it enters that nobody sees it."""


class Constant(Value):
    """A number or vector that is known ahead."""

    def __init__(self, graph: Graph, value: Plain) -> None:
        self.graph = graph
        self.value = value

    @property
    def is_vector(self) -> bool:
        return isinstance(self.value, tuple)


class Entry(Value):
    """The entry of a menu that is chosen; `menu` is the group's own input that it is chosen in, if there."""

    def __init__(self, graph: Graph, entry: str, menu: Socket | None = None) -> None:
        self.graph, self.entry, self.menu = graph, entry, menu


class Bundle(Value):
    """Several values as one."""

    def __init__(self, graph: Graph, items: Mapping[str, Value]) -> None:
        self.graph, self.items = graph, items


class Nothing(Value):
    """A closure that is too dark to be seen."""

    def __init__(self, graph: Graph) -> None:
        self.graph = graph


class Later(Value):
    """A value whose node is made once, when its socket is first asked for."""

    def __init__(self, graph: Graph, make: Callable[[], Value], is_vector: bool) -> None:
        self.graph = graph
        self.make = make
        self.vector = is_vector
        self.made: Value | None = None

    @property
    def socket(self) -> bpy.types.NodeSocket:
        if self.made is None:
            self.made = self.make()
        return self.made.socket

    @property
    def is_vector(self) -> bool:
        return self.vector


class Folding(Graph):
    """Fills `tree` with the least that gives what a group gives for one `use` of it."""

    def __init__(self, tree: bpy.types.ShaderNodeTree, use: Use) -> None:
        super().__init__(tree)
        self._use = use
        self._given: Mapping[str, Value] | None = None
        self._outer = self
        self._menus: dict[Socket, Sequence[tuple[str, str, Operand]]] = {}
        self._shared: dict[object, Value] = {}  # by what they are: made once in all groups that are built in place

    # What is known

    def plain(self, value: Operand) -> Operand:
        """Return the number or vector where `value` is known ahead, else `value`; a color without its alpha."""
        if isinstance(value, Constant):
            return value.value
        return value[:3] if isinstance(value, tuple) else value

    def value(self, value: Operand) -> Value:
        return value if isinstance(value, Value) else Constant(self, value)

    def known(self, value: Operand) -> Plain | None:
        value = self.plain(value)
        return None if isinstance(value, Value) else value

    def all_known(self, *values: Operand) -> list[Plain] | None:
        """Return the numbers and vectors where all `values` are known ahead, else None."""
        known = [each for each in map(self.known, values) if each is not None]
        return known if len(known) == len(values) else None

    def is_all(self, value: Operand, number: float) -> bool:
        """Return whether `value`, or each component of it, is known ahead to be `number`."""
        known = self.known(value)
        return known is not None and all(component == number for component in arithmetic.spread(known))

    def negligible(self, value: Operand) -> bool:
        """Return whether a color or weight that was worked out ahead is below LEAST; what is written as a number is meant to be."""
        return isinstance(value, Constant) and all(abs(x) < LEAST for x in arithmetic.spread(value.value))

    def input(self, socket: Socket) -> Value:
        if self._given is None:
            return self._own_input(socket)
        given = self._given.get(socket.name)
        if given is None and isinstance(socket.default, (float, tuple)):
            given = self.value(self.plain(socket.default))
        if isinstance(given, Constant) and socket.kind in WIDE:
            given = Constant(self, arithmetic.spread(given.value))
        if given is None:
            raise TypeError(f"{socket.name} is neither given nor has a number for it")
        return given

    def _own_input(self, socket: Socket) -> Value:
        known = self._use.inputs.get(socket.name)
        if socket == NORMAL and known != DARK:  # a constant that is folded is no normal to Cycles' OSL: it takes the surface's own
            known = None
        if known is None:
            return self._once(("input", socket.name), lambda: Graph.input(self, socket), socket.kind in WIDE)
        if isinstance(known, str):
            return Entry(self, known, socket)
        return Constant(self, DARK if self._use.flat and socket == MEAN_FREE_PATH else known)

    def in_eevee(self) -> Value:
        return self._settled("in_eevee", self._use.eevee)

    def uses_osl(self) -> Value:
        return self._settled("uses_osl", self._use.osl)

    def meter(self) -> Value:
        return self._settled("meter", self._use.meter)

    def _settled(self, name: str, value: float | None) -> Value:
        if value is None:
            return self._once(name, lambda: getattr(Graph, name)(self), False)
        return Constant(self, float(value))

    def _later(self, make: Callable[[], Value], is_vector: bool) -> Value:
        return Later(self, make, is_vector)

    def _once(self, key: object, make: Callable[[], Value], is_vector: bool) -> Value:
        if key not in self._shared:
            self._shared[key] = self._later(make, is_vector)
        return self._shared[key]

    # Arithmetic

    def link(self, source: Operand | str, target: bpy.types.NodeSocket) -> None:
        if not isinstance(source, str):
            source = self.plain(source)
        if isinstance(source, tuple) and target.type == "RGBA":
            source = (*source, 1.0)
        elif isinstance(source, float) and target.type == "INT":
            source = int(source)
        super().link(source, target)

    def node(self, kind: str, inputs: Mapping[int | str, Operand], output: int | str = 0, **properties: object) -> Value:
        known = self.all_known(*inputs.values()) if kind in (SCALAR, VECTOR) else None
        if known is not None:
            return Constant(self, arithmetic.node(kind == VECTOR, str(properties["operation"]), known))
        is_vector = output in VECTOR_OUTPUTS or kind == "ShaderNodeCombineXYZ"
        return self._later(lambda: Graph.node(self, kind, inputs, output, **properties), is_vector)

    def calculate(self, operation: str, a: Operand, b: Operand) -> Value:
        wide = [isinstance(x, tuple) or (isinstance(x, Value) and x.is_vector) for x in (a, b)]
        known = self.all_known(a, b)
        if known is not None:
            return Constant(self, arithmetic.node(any(wide), operation, known))
        none, one = ([self.is_all(x, number) for x in (a, b)] for number in (0.0, 1.0))
        if (operation == "MULTIPLY" and any(none)) or (operation == "DIVIDE" and none[0]):
            return Constant(self, DARK if any(wide) else 0.0)
        # what changes nothing, where the rest is as wide as the result
        neutral = {"ADD": none, "SUBTRACT": [False, none[1]], "MULTIPLY": one, "DIVIDE": [False, one[1]]}.get(
            operation, [False] * 2
        )
        for neutral_here, other, other_wide in zip(neutral, (b, a), reversed(wide), strict=True):
            if neutral_here and isinstance(other, Value) and other_wide == any(wide):
                return other
        return super().calculate(operation, self.plain(a), self.plain(b))

    def scale(self, vector: Operand, factor: Operand) -> Value:
        known = self.all_known(vector, factor)
        if known is not None:
            return Constant(self, arithmetic.vector("MULTIPLY", *known))
        if self.is_all(vector, 0.0) or self.is_all(factor, 0.0):
            return Constant(self, DARK)
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
        return Constant(self, tuple(each for each in known if isinstance(each, float)))

    def separate(self, vector: Value) -> tuple[Value, ...]:
        known = self.known(vector)
        if isinstance(known, tuple):
            return tuple(Constant(self, component) for component in known)
        return self._together(lambda: dict(enumerate(Graph.separate(self, vector))), dict.fromkeys(range(3), False))

    def geometry(self, output: str) -> Value:
        return self._once(("geometry", output), lambda: Graph.geometry(self._outer, output), True)

    def mix(self, factor: Operand, first: Operand, second: Operand) -> Value:
        known = self.known(factor)
        if known in (0.0, 1.0):
            return self.value(self.plain(second if known else first))
        return self._later(lambda: Graph.mix(self, factor, first, second), True)

    # Closures

    def diffuse(self, color: Operand, normal: Value, roughness: Operand = 0.0, share: float = 1.0) -> Value:
        if self.negligible(color):
            return Nothing(self)
        same = (*map(_identity, map(self.plain, (color, normal, roughness))), share)
        if same not in self._shared:
            self._shared[same] = super().diffuse(color, normal, roughness, share)
        return self._shared[same]

    def subsurface(
        self, falloff: str, color: Operand, radius: Operand, scale: Operand, normal: Value, ior: float | None = None
    ) -> Value:
        if self.is_all(radius, 0.0) or self.is_all(scale, 0.0):
            return self.diffuse(color, normal)
        return Nothing(self) if self.negligible(color) else super().subsurface(falloff, color, radius, scale, normal, ior)

    def beckmann(self, color: Operand, roughness: Operand, normal: Value) -> Value:
        return Nothing(self) if self.negligible(color) else super().beckmann(color, roughness, normal)

    def emission(self, radiance: Value) -> Value:
        return Nothing(self) if self.negligible(radiance) else super().emission(radiance)

    def shader_to_rgb(self, shader: Value) -> Value:
        return Constant(self, DARK) if isinstance(shader, Nothing) else super().shader_to_rgb(shader)

    def add_shader(self, first: Value, *others: Value) -> Value:
        shining = [shader for shader in (first, *others) if not isinstance(shader, Nothing)]
        return super().add_shader(*shining) if shining else first

    def mix_shader(self, factor: Operand, first: Value | None, second: Value) -> Value:
        first = first or Nothing(self)
        share = self.known(factor)
        if first is second or (isinstance(share, float) and share < LEAST):
            return first
        if isinstance(share, float) and share > 1.0 - LEAST:
            return second
        if isinstance(second, Nothing):
            return first if isinstance(first, Nothing) else super().mix_shader(1.0 - self.value(factor), None, first)
        return super().mix_shader(factor, None if isinstance(first, Nothing) else first, second)

    def script(self, stem: str, **inputs: Operand) -> Value:
        return self._later(lambda: Graph.script(self, stem, **inputs), False)

    # Groups, menus and bundles

    def group(self, group: Group, **inputs: Operand | str) -> dict[str, Value]:
        """Return the outputs of another group, built in place; the group of the lamps stays one, for all materials to follow."""
        if group is LIGHTS:
            return self._lamps()
        inner = copy(self)
        inner._given = {
            name.replace("_", " "): Entry(self, value) if isinstance(value, str) else self.value(self.plain(value))
            for name, value in inputs.items()
        }
        return dict(group.build(inner))

    def _lamps(self) -> dict[str, Value]:
        shown = [slot for slot, shines in enumerate(self._use.shining, 1) if shines]
        outputs = self._together(lambda: Graph.group(self, LIGHTS), {f"{name} {slot}": True for slot in shown for name in "LE"})
        dark = {f"{name} {slot}": Constant(self, DARK) for slot in range(1, SLOTS + 1) for name in "LE"}
        return dark | dict(zip((f"{name} {slot}" for slot in shown for name in "LE"), outputs, strict=True))

    def _together[Place](self, make: Callable[[], Mapping[Place, Value]], outputs: Mapping[Place, bool]) -> tuple[Value, ...]:
        """Return several outputs of one node, made when the first of them is needed; `outputs` says which are vectors."""
        made: dict[Place, Value] = {}

        def output(place: Place) -> Value:
            if not made:
                made.update(make())
            return made[place]

        return tuple(self._later(lambda place=place: output(place), is_vector) for place, is_vector in outputs.items())

    def menu(self, menu: Value, kind: str, cases: Sequence[tuple[str, str, Operand]]) -> Value:
        if not isinstance(menu, Entry):
            raise TypeError("a node chooses from the menu")
        if menu.menu:
            self._menus[menu.menu] = [(name, description, 0.0) for name, description, _ in cases]
        return self.value(next(value for name, _, value in cases if name == menu.entry))

    def bundle(self, items: Mapping[str, tuple[str, Operand]]) -> Value:
        return Bundle(self, {name: self.value(value) for name, (_, value) in items.items()})

    def unbundle(self, bundle: Value, kinds: Mapping[str, str]) -> dict[str, Value]:
        if not isinstance(bundle, Bundle):
            raise TypeError("not one of the bundles that are chosen from")
        return {name: bundle.items[name] for name in kinds}

    def end(self, outputs: Mapping[str, Value]) -> None:
        super().end({name: value for name, value in outputs.items() if not isinstance(value, Nothing)})
        for socket, entries in self._menus.items():  # which feed nothing: a menu knows its entries by the node that it is linked to
            Graph.menu(self, Graph.input(self, socket), "FLOAT", entries)


def _identity(value: Operand) -> object:
    """Return what is equal for values that are the same."""
    return id(value) if isinstance(value, Value) else value
