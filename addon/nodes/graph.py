# SPDX-License-Identifier: GPL-3.0-or-later
"""Node groups written as arithmetic: a `Graph` fills a shader node tree, its `Value`s are sockets that know + - * / and more.

Plain Python numbers stay numbers as long as they meet only numbers: + - * / of them makes no node.
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import bpy

from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR
from ..blender.osl import compile_osl

# Layout in the node editor's units: the width of a column, and what a node and each of its input sockets take of its height.
COLUMN, NODE_HEIGHT, SOCKET_HEIGHT = 220.0, 130.0, 24.0
NODE_WIDTH = 200  # of a node that holds a group of ours
KINDS = {"SHADER": "SHADER", "VALUE": "FLOAT", "VECTOR": "VECTOR", "RGBA": "VECTOR"}  # of items of a Repeat zone, by type of socket
LONGEST = 1e18  # of a vector: its square is still finite in 32-bit floats

type Number = float | Value
type Operand = Number | tuple[float, ...]


@dataclass(frozen=True)
class Socket:
    """One input of a group as the artist sees it; `kind` is the bl_socket_idname."""

    name: str
    kind: str
    description: str
    default: float | bool | tuple[float, ...] | str | None = None
    minimum: float | None = None
    maximum: float | None = None
    hide_value: bool = False
    subtype: str = "NONE"
    panel: str = ""
    """The name of the panel that it is in; empty for none."""


COLOR = Socket("Color", "NodeSocketColor", "Albedo rho: the share of light that is reflected, per channel", (0.8, 0.8, 0.8, 1.0))
NORMAL = Socket(
    "Normal", "NodeSocketVector", "Shading normal; the surface's own where nothing is connected", (0.0, 0.0, 0.0), hide_value=True
)


@dataclass(frozen=True)
class Group:
    """A node group as code. `key` and `name` are stable; a file's groups are found again by key and version.

    `build` returns the outputs by name.

    Raise `version` whenever `build` or the sockets change, so that files made with an older one get a new group.
    """

    key: str
    name: str
    label: str
    version: int
    description: str
    inputs: tuple[Socket, ...]
    build: Callable[["Graph"], Mapping[str, "Value"]]
    open_panel: str = ""
    """The name of the panel that a new node shows open."""

    @property
    def identifier(self) -> str:
        return f"{self.key}/{self.version}"

    def ensure(self) -> bpy.types.ShaderNodeTree:
        """Return this group's node tree in the current file, building it if it is not there yet.

        A tree of the user's that happens to have the same name is left alone.
        """
        trees = self.trees()
        if trees:
            # the user's copies of it have the identifier, too, but another name
            return next((tree for tree in trees if tree.name == self.name), trees[0])
        tree = bpy.data.node_groups.new(self.name, "ShaderNodeTree")
        tree[GROUP_ID] = self.identifier
        tree.description = self.description
        tree.color_tag = "SHADER"
        tree.default_group_node_width = NODE_WIDTH  # where Blender makes the node; `add_group` sets it for ours
        for socket in self.inputs:
            _add_input(tree, socket, is_open=socket.panel == self.open_panel)
        _fill(tree, self.build)
        for socket in self.inputs:  # a menu knows its entries once it is linked
            if socket.kind == "NodeSocketMenu":
                tree.interface.items_tree[socket.name].default_value = socket.default
        return tree

    def trees(self, linked: bool = False) -> list[bpy.types.ShaderNodeTree]:
        """Return this group's trees in the current file, its own or those `linked` from others; appended ones come beside."""
        whole = (tree for tree in bpy.data.node_groups if tree.get(GROUP_ID) == self.identifier and SPECIALIZED_FOR not in tree)
        return [tree for tree in whole if (tree.library is not None) == linked]

    def rebuild(self, build: Callable[["Graph"], Mapping[str, "Value"]]) -> None:
        """Fill all of this group's own trees in the current file anew, by a `build` with the same outputs: all users follow."""
        self.ensure()
        for tree in self.trees():
            tree.nodes.clear()
            tree.animation_data_clear()
            _fill(tree, build)


def _fill(tree: bpy.types.ShaderNodeTree, build: Callable[["Graph"], Mapping[str, "Value"]]) -> None:
    """Build the nodes of an empty `tree`, and the outputs that it lacks."""
    graph = Graph(tree)
    outputs = build(graph)
    for index, (name, value) in enumerate(outputs.items()):
        if name not in tree.interface.items_tree:
            output = tree.interface.new_socket(name, in_out="OUTPUT", socket_type=value.socket.bl_idname)
            tree.interface.move(output, index)  # above panels
    graph.end(outputs)
    graph.arrange()
    tree[BUILT_FINGERPRINT] = fingerprint(tree)


def fingerprint(tree: bpy.types.ShaderNodeTree) -> str:
    """Return what tells whether somebody has changed the nodes of `tree`: a hash of their kinds, operations, values and links."""
    seen = hashlib.sha256()
    for node in tree.nodes:
        inner = getattr(node, "node_tree", None)
        choices = [getattr(node, name, "") for name in ("operation", "data_type", "distribution", "falloff", "mute")]
        seen.update(repr((node.name, node.bl_idname, choices, inner.get(GROUP_ID) if inner else None)).encode())
        for socket in node.inputs:
            value = getattr(socket, "default_value", None)
            seen.update(repr(value if value is None or isinstance(value, (str, int, float)) else tuple(value)).encode())
    for link in tree.links:
        ends = link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier
        seen.update(repr(ends).encode())
    return seen.hexdigest()


def key_and_version(node: bpy.types.Node) -> tuple[str, str]:
    """Return key and version of our group that `node` holds, in whichever version; empty where it holds none."""
    tree = node.node_tree if node.type == "GROUP" else None
    key, _, version = str(tree.get(GROUP_ID, "") if tree else "").partition("/")
    return key, version


def _add_input(tree: bpy.types.ShaderNodeTree, socket: Socket, is_open: bool) -> None:
    panels = {item.name: item for item in tree.interface.items_tree if item.item_type == "PANEL"}
    parent = None
    if socket.panel:
        parent = panels.get(socket.panel) or tree.interface.new_panel(socket.panel, default_closed=not is_open)
    item = tree.interface.new_socket(socket.name, in_out="INPUT", socket_type=socket.kind, parent=parent)
    item.description = socket.description
    item.hide_value = socket.hide_value
    item.optional_label = socket.kind == "NodeSocketMenu"  # so that an entry has the whole width of the node
    if socket.subtype != "NONE":
        item.subtype = socket.subtype
    if socket.default is not None and socket.kind != "NodeSocketMenu":
        item.default_value = socket.default
    if socket.minimum is not None:
        item.min_value = socket.minimum
    if socket.maximum is not None:
        item.max_value = socket.maximum


class Value:
    """An output socket in a graph that can be calculated with; numbers on the other side are fine.

    Between a vector (or color) and a number the number counts for each component.
    """

    def __init__(self, graph: "Graph", socket: bpy.types.NodeSocket) -> None:
        self.graph = graph
        self.socket = socket

    @property
    def is_vector(self) -> bool:
        return self.socket.type in {"VECTOR", "RGBA"}

    def __add__(self, other: Operand) -> "Value":
        return self.graph.calculate("ADD", self, other)

    def __radd__(self, other: Operand) -> "Value":
        return self.graph.calculate("ADD", other, self)

    def __sub__(self, other: Operand) -> "Value":
        return self.graph.calculate("SUBTRACT", self, other)

    def __rsub__(self, other: Operand) -> "Value":
        return self.graph.calculate("SUBTRACT", other, self)

    def __mul__(self, other: Operand) -> "Value":
        return self.graph.calculate("MULTIPLY", self, other)

    def __rmul__(self, other: Operand) -> "Value":
        return self.graph.calculate("MULTIPLY", other, self)

    def __truediv__(self, other: Operand) -> "Value":
        return self.graph.calculate("DIVIDE", self, other)

    def __rtruediv__(self, other: Operand) -> "Value":
        return self.graph.calculate("DIVIDE", other, self)

    def __pow__(self, exponent: Operand) -> "Value":
        return self.graph.power(self, exponent)


class Graph:
    """Fills `tree` with nodes. Method names are those of the field; each returns the new node's output as a `Value`. It is the
    `models.terms.Arithmetic` of sockets.
    """

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

    def node(self, kind: str, inputs: Mapping[int | str, Operand], output: int | str = 0, **properties: object) -> Value:
        """Return an output of a new node of the given bl_idname, its inputs and properties set; both by name or place."""
        node = self.add(kind, **properties)
        for place, value in inputs.items():
            self.link(value, node.inputs[place])
        return Value(self, node.outputs[output])

    def link(self, source: Operand | str, target: bpy.types.NodeSocket) -> None:
        """Connect a value to an input socket, or set the socket to a plain number, tuple or entry of a menu."""
        if isinstance(source, Value):
            self.tree.links.new(source.socket, target)
        elif isinstance(source, (int, float)) and target.type == "VECTOR":
            target.default_value = (source,) * 3
        elif isinstance(source, (int, float)) and target.type == "RGBA":
            target.default_value = (source, source, source, 1.0)
        else:
            target.default_value = source

    def input(self, socket: Socket) -> Value:
        """Return the group's own input."""
        return Value(self, self._inputs.outputs[socket.name])

    def end(self, outputs: Mapping[str, Value]) -> None:
        """Connect the group's own outputs."""
        node = self.add("NodeGroupOutput")
        for name, value in outputs.items():
            self.link(value, node.inputs[name])

    def geometry(self, output: str) -> Value:
        """Return an output of the Geometry node: Normal, Incoming (towards the viewer), Position."""
        if self._geometry is None:
            self._geometry = self.add("ShaderNodeNewGeometry")
        return Value(self, self._geometry.outputs[output])

    def is_diffuse_ray(self) -> Value:
        """Return 1 where the surface is seen by light that a diffuse closure scattered, else 0."""
        return self.node("ShaderNodeLightPath", {}, "Is Diffuse Ray")

    def calculate(self, operation: str, a: Operand, b: Operand) -> Value:
        """Return a Math node, or a Vector Math one where an operand is a vector; leaves out what changes nothing."""
        if operation == "MULTIPLY" and 1.0 in (a, b):
            return next(x for x in (a, b) if isinstance(x, Value))
        if operation == "ADD" and 0.0 in (a, b):
            return next(x for x in (a, b) if isinstance(x, Value))
        vectors = [isinstance(x, tuple) or (isinstance(x, Value) and x.is_vector) for x in (a, b)]
        if not any(vectors):
            return self.math(operation, a, b)
        if operation == "MULTIPLY" and not all(vectors):
            return self.scale(*((a, b) if vectors[0] else (b, a)))
        return self.vector_math(operation, a, b)

    def math(self, operation: str, *operands: Operand) -> Value:
        """Return a Math node of the given operation."""
        return self.node("ShaderNodeMath", dict(enumerate(operands)), operation=operation)

    def per_scene(self, label: str, expression: str, **properties: str) -> Value:
        """Return a number that a driver works out from properties of the scene: once per scene, so it costs nothing per pixel.

        `properties` are data paths by the names they have in `expression`, which must be simple enough to need no permission to
        run scripts.
        """
        driver, socket = self._driven(label)
        for name, path in properties.items():
            variable = driver.variables.new()
            variable.name, variable.type = name, "CONTEXT_PROP"
            variable.targets[0].context_property = "ACTIVE_SCENE"
            variable.targets[0].data_path = path
        driver.expression = expression
        return Value(self, socket)

    def constant(self, value: float) -> Value:
        """Return a plain number as an output."""
        node = self.add("ShaderNodeValue")
        node.outputs[0].default_value = value
        return Value(self, node.outputs[0])

    def property(self, label: str, owner: bpy.types.ID, path: str) -> Value:
        """Return a number that a driver keeps equal to a property of a data-block."""
        driver, socket = self._driven(label)
        variable = driver.variables.new()
        variable.type = "SINGLE_PROP"
        variable.targets[0].id_type, variable.targets[0].id = owner.id_type, owner
        variable.targets[0].data_path = path
        driver.type = "SUM"
        return Value(self, socket)

    def location(self, owner: bpy.types.Object, axis: str) -> Value:
        """Return a component, X, Y or Z, of an object's place in the world."""
        driver, socket = self._driven(f"{owner.name} {axis}")
        self._transform(driver, axis, owner, f"LOC_{axis}")
        driver.type = "SUM"
        return Value(self, socket)

    def rotation(self, label: str, owner: bpy.types.Object, expression: str) -> Value:
        """Return what `expression` makes of the quaternion w, x, y, z of an object's rotation in the world."""
        driver, socket = self._driven(label)
        for axis in "WXYZ":
            variable = self._transform(driver, axis.lower(), owner, f"ROT_{axis}")
            variable.targets[0].rotation_mode = "QUATERNION"
        driver.expression = expression
        return Value(self, socket)

    def _driven(self, label: str) -> tuple[bpy.types.Driver, bpy.types.NodeSocket]:
        node = self.add("ShaderNodeValue", label=label)
        return node.outputs[0].driver_add("default_value").driver, node.outputs[0]

    def _transform(self, driver: bpy.types.Driver, name: str, owner: bpy.types.Object, channel: str) -> bpy.types.DriverVariable:
        variable = driver.variables.new()
        variable.name, variable.type = name, "TRANSFORMS"
        variable.targets[0].id, variable.targets[0].transform_type = owner, channel
        return variable

    def vector(self, x: Operand, y: Operand, z: Operand) -> Value:
        """Return three numbers as a vector."""
        return self.node("ShaderNodeCombineXYZ", {0: x, 1: y, 2: z})

    def separate(self, vector: Value) -> tuple[Value, ...]:
        """Return the three components of a vector."""
        node = self.add("ShaderNodeSeparateXYZ")
        self.link(vector, node.inputs[0])
        return tuple(Value(self, output) for output in node.outputs)

    def in_eevee(self) -> Value:
        """Return 1 where the scene's render engine is EEVEE, the first entry of Blender's list of engines, else 0."""
        return self.per_scene("In EEVEE", "1 if engine == 0 else 0", engine="render.engine")

    def uses_osl(self) -> Value:
        """Return 1 where the scene renders with another engine (Cycles) and Open Shading Language, else 0; for a Blender with OSL.

        It counts as used where the scene has it on and renders on the CPU, as few other devices have it.
        """
        paths = {"engine": "render.engine", "osl": "cycles.shading_system", "device": "cycles.device"}
        return self.per_scene("Uses OSL", "1 if engine and osl and not device else 0", **paths)

    def meter(self) -> Value:
        """Return how many of the scene's units a meter has."""
        return self.per_scene("Meter", "1 / unit", unit="unit_settings.scale_length")

    def multiply_add(self, a: Operand, b: Operand, c: Operand) -> Value:
        """Return a b + c in one node; with a vector among them, numbers count for each component."""
        if any(isinstance(x, Value) and x.is_vector for x in (a, b, c)):
            return self.vector_math("MULTIPLY_ADD", a, b, c)
        return self.math("MULTIPLY_ADD", a, b, c)

    def maximum(self, a: Operand, b: Operand) -> Value:
        return self.calculate("MAXIMUM", a, b)

    def minimum(self, a: Operand, b: Operand) -> Value:
        return self.calculate("MINIMUM", a, b)

    def clamp(self, a: Operand, low: float, high: float) -> Value:
        """Return `a` between `low` and `high`, NaN as `low`: the order of the operands decides that, in both engines."""
        return self.minimum(self.maximum(low, a), high)

    def sqrt(self, a: Operand) -> Value:
        """Return the square root, 0 below 0; of a vector, of each component."""
        return self.power(self.maximum(a, 0.0), 0.5) if isinstance(a, Value) and a.is_vector else self.math("SQRT", a)

    def power(self, base: Operand, exponent: Operand) -> Value:
        """Return base^exponent; with a vector among them, numbers count for each component."""
        return self.calculate("POWER", base, exponent)

    def arccosine(self, a: Operand) -> Value:
        return self.math("ARCCOSINE", a)

    def absolute(self, a: Operand) -> Value:
        return self.math("ABSOLUTE", a)

    def less_than(self, a: Operand, b: Operand) -> Value:
        return self.math("LESS_THAN", a, b)

    def equals(self, a: Operand, b: Operand) -> Value:
        """Return 1 where two numbers are equal, or 1e-7 apart, else 0."""
        return self.math("COMPARE", a, b, 0.0)

    def mean(self, vector: Value) -> Value:
        """Return the mean of a vector's components."""
        return self.vector_math("DOT_PRODUCT", vector, (1.0 / 3.0,) * 3, output="Value")

    def largest(self, vector: Value) -> Value:
        """Return the largest of a vector's components."""
        x, y, z = self.separate(vector)
        return self.maximum(self.maximum(x, y), z)

    def normalize(self, vector: Value) -> Value:
        return self.vector_math("NORMALIZE", vector)

    def vector_math(self, operation: str, *operands: Operand, output: str = "Vector") -> Value:
        """Return a Vector Math node of the given operation."""
        return self.node("ShaderNodeVectorMath", dict(enumerate(operands)), output, operation=operation)

    def dot(self, a: Value, b: Value) -> Value:
        return self.vector_math("DOT_PRODUCT", a, b, output="Value")

    def scale(self, vector: Operand, factor: Operand) -> Value:
        """Return a vector or a color times a number."""
        return self.node("ShaderNodeVectorMath", {"Vector": vector, "Scale": factor}, "Vector", operation="SCALE")

    def normal(self) -> tuple[Value, Value]:
        """Return N at unit length, the group's Normal input, and 1; where nothing is connected the surface's own normal, and 0.

        It is the surface's own where the input is NaN. What is longer than LONGEST counts as that long along each axis.
        """
        given = self.input(NORMAL)
        unit = self.normalize(self.clamp(given, -LONGEST, LONGEST))  # a Mix would let NaN through even at factor 0
        is_given = self.math("GREATER_THAN", self.vector_math("LENGTH", given, output="Value"), 0.0)
        own = self.geometry("Normal")
        unmapped = self.is_known(is_given, 0.0)
        return self.switch(unmapped, {0: self.mix(is_given, own, unit), 1: own}), 1.0 - unmapped

    def mix(self, factor: Operand, first: Operand, second: Operand) -> Value:
        """Return the vector `first` at `factor` 0, `second` at 1, and between them a fraction of each."""
        choice = self.add("ShaderNodeMix", data_type="VECTOR", factor_mode="UNIFORM")
        inputs = (socket for socket in choice.inputs if socket.enabled)
        for value, socket in zip((factor, first, second), inputs, strict=True):
            self.link(value, socket)
        return Value(self, next(socket for socket in choice.outputs if socket.enabled))

    def diffuse(self, color: Operand, normal: Value, roughness: Operand = 0.0, share: float = 1.0) -> Value:
        """Return a Diffuse closure around `normal` of a `share` of `color`: Lambert at `roughness` 0, else what the engine has."""
        if share != 1.0:
            color = self.calculate("MULTIPLY", color, share)
        return self.node("ShaderNodeBsdfDiffuse", {"Color": color, "Roughness": roughness, "Normal": normal})

    def unscattered(self, color: Operand, normal: Value) -> Value:
        """Return a Subsurface closure whose radius is 0: Lambert, in a place of its own in EEVEE's list of closures."""
        return self.node("ShaderNodeSubsurfaceScattering", {"Color": color, "Scale": 0.0, "Normal": normal}, falloff="BURLEY")

    def subsurface(
        self, falloff: str, color: Operand, radius: Operand, scale: Operand, normal: Value, ior: float | None = None
    ) -> Value:
        """Return a Subsurface closure; light enters a random walk as through a smooth surface of index `ior`."""
        inputs: dict[int | str, Operand] = {"Color": color, "Radius": radius, "Scale": scale, "Normal": normal}
        if ior is not None:
            inputs["IOR"] = ior
            if falloff != "RANDOM_WALK_SKIN":
                inputs["Roughness"] = 0.0
        return self.node("ShaderNodeSubsurfaceScattering", inputs, falloff=falloff)

    def glossy(self, roughness: Operand, normal: Value) -> Value:
        """Return a GGX reflection closure that loses nothing, without Fresnel, alpha = `roughness` squared."""
        inputs: dict[int | str, Operand] = {"Color": (1.0, 1.0, 1.0, 1.0), "Roughness": roughness, "Normal": normal}
        return self.node("ShaderNodeBsdfAnisotropic", inputs, distribution="MULTI_GGX")

    def translucent(self, color: Operand) -> Value:
        """Return a Lambert closure for light from behind."""
        return self.node("ShaderNodeBsdfTranslucent", {"Color": color})

    def beckmann(self, color: Operand, roughness: Operand, normal: Value) -> Value:
        """Return a microfacet reflection closure without Fresnel, alpha = `roughness` squared: Beckmann's, in EEVEE always GGX."""
        inputs: dict[int | str, Operand] = {"Color": color, "Roughness": roughness, "Normal": normal}
        return self.node("ShaderNodeBsdfAnisotropic", inputs, distribution="BECKMANN")

    def add_shader(self, first: Value, *others: Value) -> Value:
        """Return the sum of closures."""
        for other in others:
            first = self.node("ShaderNodeAddShader", {0: first, 1: other})
        return first

    def mix_shader(self, factor: Operand, first: Value | None, second: Value) -> Value:
        """Return `first` (None: black) at `factor` 0, `second` at 1, and between them a fraction of each.

        Where the factor is 0 or 1 everywhere, Cycles leaves the other one and all that feeds it out.
        """
        return self.node("ShaderNodeMixShader", {0: factor, 2: second} if first is None else {0: factor, 1: first, 2: second})

    def shader_to_rgb(self, shader: Value) -> Value:
        """Return the radiance of a closure under all lights, with shadows: in EEVEE alone."""
        return self.node("ShaderNodeShaderToRGB", {0: shader}, "Color")

    def emission(self, radiance: Value) -> Value:
        return self.node("ShaderNodeEmission", {"Color": radiance})

    def script(self, stem: str, **inputs: Operand) -> Value:
        """Return the closure of the OSL shader shaders/STEM.osl; `compiles_osl` says whether that can be.

        Cycles without Open Shading Language and EEVEE take it for no closure at all.
        """
        node = self.add("ShaderNodeScript", label=stem)
        compile_osl(node, stem)
        for name, value in inputs.items():
            self.link(value, node.inputs[name])
        return Value(self, node.outputs[0])

    def group(self, group: Group, **inputs: Operand | str) -> dict[str, Value]:
        """Return the outputs of another group by name; its inputs are given by their names with _ for a space."""
        node = self.add("ShaderNodeGroup", node_tree=group.ensure(), label=group.label)
        for name, value in inputs.items():
            self.link(value, node.inputs[name.replace("_", " ")])
        return {output.name: Value(self, output) for output in node.outputs}

    def menu(self, menu: Value, kind: str, cases: Sequence[tuple[str, str, Operand]]) -> Value:
        """Return what `menu` selects among `cases` (entry, description, value) of data type `kind`; the others cost nothing.

        One such node serves a menu: Blender wants its entries defined in one place.
        """
        node = self.add("GeometryNodeMenuSwitch", data_type=kind)
        node.enum_items.clear()
        for name, description, _ in cases:
            node.enum_items.new(name).description = description
        self.link(menu, node.inputs[0])
        for socket, (_, _, value) in zip(node.inputs[1:], cases, strict=False):
            self.link(value, socket)
        return Value(self, node.outputs[0])

    def switch(self, number: Operand, cases: Mapping[int, Operand]) -> Value:
        """Return the case of `number`, one of the keys; the others cost nothing, neither in a shader nor in making it.

        The first case is an output; it says what all are: closures, numbers or vectors. `number` must be known when the shader is
        made: it may come from menus, drivers, plain values and arithmetic of these.
        """
        (_, chosen), *others = cases.items()
        if not isinstance(chosen, Value):
            raise TypeError("the first case is a plain number")
        for key, case in others:
            is_it = number if tuple(cases) == (0, 1) else self.equals(number, float(key))
            chosen = self._repeat(is_it, KINDS[chosen.socket.type], chosen, case)
        return chosen

    def is_known(self, weight: Operand, value: float) -> Value:
        """Return 1 where `weight` is known to have that value when the shader is made, else 0: also where it varies.

        So a group leaves out what a weight of 0 or 1 makes needless. Where something that varies is linked to it, Blender has no
        number of iterations, gives a 0 and notes that at the node, which only this group's own editor shows.
        """
        return self._repeat(self.equals(weight, value), "FLOAT", 0.0, 1.0)

    def _repeat(self, iterations: Operand, kind: str, none: Operand, one: Operand) -> Value:
        """Return `none` at 0 iterations of a Repeat zone, else `one`.

        Before it makes a shader Blender resolves such a zone if it has an item that is no number, and looks at no more than what
        comes out of it (5.2, shader_nodes_inline.cc). No other node chooses by a number then.
        """
        begin, end = self.add("GeometryNodeRepeatInput"), self.add("GeometryNodeRepeatOutput")
        begin.pair_with_output(end)
        end.repeat_items.clear()
        end.repeat_items.new(kind, "Item")
        if kind != "SHADER":
            end.repeat_items.new("SHADER", "No Number")
        self.link(iterations, begin.inputs["Iterations"])
        self.link(none, begin.inputs["Item"])
        self.link(one, end.inputs["Item"])
        return Value(self, end.outputs["Item"])

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
        places: list[float] = []
        for node in self.tree.nodes:
            x = column(node.name)
            y = next_y.get(x, 0.0)
            places += (x * COLUMN, y)
            next_y[x] = y - NODE_HEIGHT - SOCKET_HEIGHT * sum(socket.enabled for socket in (*node.inputs, *node.outputs))
        # all at once: Blender updates the whole tree each time that a single node moves
        self.tree.nodes.foreach_set("location", places)
        self.tree.nodes.foreach_set("select", [False] * len(self.tree.nodes))
