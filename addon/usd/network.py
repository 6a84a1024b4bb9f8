# SPDX-License-Identifier: GPL-3.0-or-later
"""A shading network as plain values: shaders with USD's identifiers and types, and their connections. No pxr."""

from dataclasses import dataclass, field
from typing import NamedTuple

COLOR, FLOAT, VECTOR2, VECTOR3, VECTOR4 = "color3f", "float", "float2", "float3", "float4"
NORMAL = "normal3f"
COLOR4, STRING, TOKEN, FILE, BOOL, INT = "color4f", "string", "token", "asset", "bool", "int"


class Output(NamedTuple):
    """An output of a shader of the same network. As the source of an input, `type` is that of the input."""

    shader: str
    name: str
    type: str


class Constant(NamedTuple):
    """A value of a USD type; of a file also its color space, by the names that MaterialX and OpenUSD have for it."""

    type: str
    value: object
    color_space: str = ""
    interop_id: str = ""


class Primvar(NamedTuple):
    """The name of a UV map or color attribute, as Blender has it; its name in USD depends on the mesh (primvars.py).

    Without a `name` it is the UV map that renders, or the active color attribute.
    """

    name: str
    kind: str
    """uv, color or value; a value is any other attribute."""
    type: str = STRING


type Input = Output | Constant | Primvar


@dataclass(frozen=True)
class Shader:
    """A node: its identifier in USD's shader registry, its inputs by name, and the types of its outputs by name."""

    identifier: str
    inputs: dict[str, Input]
    outputs: dict[str, str]


@dataclass
class Network:
    """Shaders by name, sources first; each name begins with `prefix`. The last shader is the surface."""

    prefix: str
    shaders: dict[str, Shader] = field(default_factory=dict)

    def add(self, name: str, identifier: str, kind: str, output: str = "out", **inputs: Input) -> Output:
        """Add a shader whose `output` is of type `kind`, and return that output. A name that is taken gets a number."""
        free, count = f"{self.prefix}{name}", 2
        while free in self.shaders:
            free, count = f"{self.prefix}{name}_{count}", count + 1
        self.shaders[free] = Shader(identifier, inputs, {output: kind})
        return Output(free, output, kind)

    def output(self, of: Output, name: str, kind: str) -> Output:
        """Return another output of the shader that `of` belongs to."""
        self.shaders[of.shader].outputs[name] = kind
        return Output(of.shader, name, kind)

    @property
    def surface(self) -> Output:
        """The output of the surface."""
        name, shader = list(self.shaders.items())[-1]
        output, kind = next(iter(shader.outputs.items()))
        return Output(name, output, kind)
