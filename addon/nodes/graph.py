# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups written as arithmetic: a `Graph` fills a shader node tree, its `Value`s are sockets that know + - * / and more.

Plain Python numbers stay numbers as long as they meet only numbers: + - * / of them makes no node.
"""

from collections.abc import Callable
from dataclasses import dataclass

import bpy

STAMP = "true_diffuse"  # custom property that marks a tree as ours: "key/version"
# Layout in the node editor's units: the width of a column, and what a node and each of its input sockets take of its height.
COLUMN, NODE_HEIGHT, SOCKET_HEIGHT = 220.0, 130.0, 24.0

type Operand = float | Value


@dataclass(frozen=True)
class Socket:
    """One input of a group as the artist sees it; `kind` is the bl_socket_idname."""

    name: str
    kind: str
    description: str
    default: float | tuple[float, ...] | None = None
    minimum: float | None = None
    maximum: float | None = None
    hide_value: bool = False
    subtype: str = "NONE"


COLOR = Socket("Color", "NodeSocketColor", "Albedo rho: the share of light that is reflected, per channel", (0.8, 0.8, 0.8, 1.0))
NORMAL = Socket(
    "Normal", "NodeSocketVector", "Shading normal; the surface's own where nothing is connected", (0.0, 0.0, 0.0), hide_value=True
)


@dataclass(frozen=True)
class Group:
    """A node group as code. `key` and `name` are stable; a file's groups are found again by the stamp of key and version.

    Raise `version` whenever `build` or the sockets change, so that files made with an older one get a new group.
    """

    key: str
    name: str
    version: int
    description: str
    inputs: tuple[Socket, ...]
    build: Callable[["Graph"], "Value"]

    @property
    def stamp(self) -> str:
        return f"{self.key}/{self.version}"

    def ensure(self) -> bpy.types.ShaderNodeTree:
        """Return this group's node tree in the current file, building it if it is not there yet.

        A tree of the user's that happens to have the same name is left alone.
        """
        for tree in bpy.data.node_groups:
            if tree.get(STAMP) == self.stamp and tree.library is None:
                return tree
        tree = bpy.data.node_groups.new(self.name, "ShaderNodeTree")
        tree[STAMP] = self.stamp
        tree.description = self.description
        tree.color_tag = "SHADER"
        for socket in self.inputs:
            _add_input(tree, socket)
        tree.interface.new_socket("BSDF", in_out="OUTPUT", socket_type="NodeSocketShader")
        graph = Graph(tree)
        graph.link(self.build(graph), graph.add("NodeGroupOutput").inputs[0])
        graph.arrange()
        return tree


def _add_input(tree: bpy.types.ShaderNodeTree, socket: Socket) -> None:
    item = tree.interface.new_socket(socket.name, in_out="INPUT", socket_type=socket.kind)
    item.description = socket.description
    item.hide_value = socket.hide_value
    if socket.subtype != "NONE":
        item.subtype = socket.subtype
    if socket.default is not None:
        item.default_value = socket.default
    if socket.minimum is not None:
        item.min_value = socket.minimum
    if socket.maximum is not None:
        item.max_value = socket.maximum


class Value:
    """An output socket in a graph that can be calculated with; numbers on the other side are fine."""

    def __init__(self, graph: "Graph", socket: bpy.types.NodeSocket) -> None:
        self.graph = graph
        self.socket = socket

    def __add__(self, other: Operand) -> "Value":
        return self.graph.math("ADD", self, other)

    def __radd__(self, other: Operand) -> "Value":
        return self.graph.math("ADD", other, self)

    def __sub__(self, other: Operand) -> "Value":
        return self.graph.math("SUBTRACT", self, other)

    def __rsub__(self, other: Operand) -> "Value":
        return self.graph.math("SUBTRACT", other, self)

    def __mul__(self, other: Operand) -> "Value":
        return self.graph.math("MULTIPLY", self, other)

    def __rmul__(self, other: Operand) -> "Value":
        return self.graph.math("MULTIPLY", other, self)

    def __truediv__(self, other: Operand) -> "Value":
        return self.graph.math("DIVIDE", self, other)

    def __rtruediv__(self, other: Operand) -> "Value":
        return self.graph.math("DIVIDE", other, self)

    def __pow__(self, exponent: Operand) -> "Value":
        return self.graph.math("POWER", self, exponent)


class Graph:
    """Fills `tree` with nodes. Method names are those of the field; each returns the new node's output as a `Value`."""

    def __init__(self, tree: bpy.types.ShaderNodeTree) -> None:
        self.tree = tree
        self._inputs = self.add("NodeGroupInput")
        self._geometry: bpy.types.Node | None = None

    def add(self, kind: str, **properties: object) -> bpy.types.Node:
        """Return a new node of the given bl_idname with its properties set."""
        node = self.tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        return node

    def link(self, source: Operand | tuple[float, ...], target: bpy.types.NodeSocket) -> None:
        """Connect a value to an input socket, or set the socket to a plain number or tuple."""
        if isinstance(source, Value):
            self.tree.links.new(source.socket, target)
        else:
            target.default_value = source

    def input(self, socket: Socket) -> Value:
        """Return the group's own input."""
        return Value(self, self._inputs.outputs[socket.name])

    def geometry(self, output: str) -> Value:
        """Return an output of the Geometry node: Normal, Incoming (towards the viewer), Position."""
        if self._geometry is None:
            self._geometry = self.add("ShaderNodeNewGeometry")
        return Value(self, self._geometry.outputs[output])

    def math(self, operation: str, *operands: Operand) -> Value:
        """Return a Math node of the given operation."""
        node = self.add("ShaderNodeMath", operation=operation)
        for operand, socket in zip(operands, node.inputs, strict=False):
            self.link(operand, socket)
        return Value(self, node.outputs[0])

    def per_engine(self, label: str, eevee: float, other: float) -> Value:
        """Return a number that is `eevee` where the scene's render engine is EEVEE, else `other`.

        A driver sets it once per scene, so it costs nothing per pixel. EEVEE is the first entry of Blender's list of engines.
        """
        node = self.add("ShaderNodeValue", label=label)
        driver = node.outputs[0].driver_add("default_value").driver
        engine = driver.variables.new()
        engine.name, engine.type = "engine", "CONTEXT_PROP"
        engine.targets[0].context_property = "ACTIVE_SCENE"
        engine.targets[0].data_path = "render.engine"
        driver.expression = f"{eevee!r} if engine == 0 else {other!r}"
        return Value(self, node.outputs[0])

    def maximum(self, a: Operand, b: Operand) -> Value:
        return self.math("MAXIMUM", a, b)

    def minimum(self, a: Operand, b: Operand) -> Value:
        return self.math("MINIMUM", a, b)

    def sqrt(self, a: Operand) -> Value:
        return self.math("SQRT", a)

    def vector_math(self, operation: str, *operands: Value | tuple[float, ...], output: str = "Vector") -> Value:
        """Return a Vector Math node of the given operation."""
        node = self.add("ShaderNodeVectorMath", operation=operation)
        for operand, socket in zip(operands, node.inputs, strict=False):
            self.link(operand, socket)
        return Value(self, node.outputs[output])

    def dot(self, a: Value, b: Value) -> Value:
        return self.vector_math("DOT_PRODUCT", a, b, output="Value")

    def scale(self, vector: Value | tuple[float, ...], factor: Operand) -> Value:
        """Return a vector or a color times a number."""
        node = self.add("ShaderNodeVectorMath", operation="SCALE")
        self.link(vector, node.inputs["Vector"])
        self.link(factor, node.inputs["Scale"])
        return Value(self, node.outputs["Vector"])

    def normal(self) -> Value:
        """Return N at unit length: the group's Normal input, or the surface's own normal where nothing is connected to it."""
        given = self.input(NORMAL)
        is_given = self.math("GREATER_THAN", self.vector_math("LENGTH", given, output="Value"), 0.0)
        choice = self.add("ShaderNodeMix", data_type="VECTOR", factor_mode="UNIFORM")
        factor, own, other = (s for s in choice.inputs if s.enabled)
        self.link(is_given, factor)
        self.link(self.geometry("Normal"), own)
        self.link(given, other)
        result = next(s for s in choice.outputs if s.enabled)
        return self.vector_math("NORMALIZE", Value(self, result))

    def diffuse(self, color: Value, normal: Value, roughness: Operand = 0.0) -> Value:
        """Return a Diffuse closure around `normal`: Lambert at `roughness` 0, else what the engine makes of it."""
        node = self.add("ShaderNodeBsdfDiffuse")
        self.link(color, node.inputs["Color"])
        self.link(roughness, node.inputs["Roughness"])
        self.link(normal, node.inputs["Normal"])
        return Value(self, node.outputs[0])

    def unscattered(self, color: Value, normal: Value) -> Value:
        """Return a Subsurface closure whose radius is 0: Lambert, in a place of its own in EEVEE's list of closures."""
        node = self.add("ShaderNodeSubsurfaceScattering", falloff="BURLEY")
        self.link(color, node.inputs["Color"])
        self.link(0.0, node.inputs["Scale"])
        self.link(normal, node.inputs["Normal"])
        return Value(self, node.outputs[0])

    def translucent(self, color: Value | tuple[float, ...]) -> Value:
        """Return a Lambert closure for light from behind."""
        node = self.add("ShaderNodeBsdfTranslucent")
        self.link(color, node.inputs["Color"])
        return Value(self, node.outputs[0])

    def beckmann(self, color: Operand | tuple[float, ...], roughness: Operand, normal: Value) -> Value:
        """Return a microfacet reflection closure without Fresnel, alpha = `roughness` squared: Beckmann's, in EEVEE always GGX."""
        node = self.add("ShaderNodeBsdfAnisotropic", distribution="BECKMANN")
        self.link(color, node.inputs["Color"])
        self.link(roughness, node.inputs["Roughness"])
        self.link(normal, node.inputs["Normal"])
        return Value(self, node.outputs[0])

    def add_shader(self, a: Value, b: Value) -> Value:
        """Return the sum of two closures."""
        node = self.add("ShaderNodeAddShader")
        self.link(a, node.inputs[0])
        self.link(b, node.inputs[1])
        return Value(self, node.outputs[0])

    def arrange(self) -> None:
        """Lay the nodes out in columns, each one right of all that feed it, so that a person can read the group."""
        feeds: dict[str, list[str]] = {node.name: [] for node in self.tree.nodes}
        for link in self.tree.links:
            feeds[link.to_node.name].append(link.from_node.name)
        depth: dict[str, int] = {}

        def column(name: str) -> int:
            if name not in depth:
                depth[name] = 1 + max(map(column, feeds[name]), default=-1)
            return depth[name]

        next_y: dict[int, float] = {}
        for node in self.tree.nodes:
            x = column(node.name)
            y = next_y.get(x, 0.0)
            node.location = (x * COLUMN, y)
            next_y[x] = y - NODE_HEIGHT - SOCKET_HEIGHT * sum(socket.enabled for socket in (*node.inputs, *node.outputs))
            node.select = False
