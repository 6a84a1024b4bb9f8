# SPDX-License-Identifier: GPL-3.0-or-later
"""A shading network as plain values: shaders with USD's identifiers and types, and their connections. No pxr."""

from dataclasses import dataclass, field
from typing import NamedTuple

COLOR, FLOAT, VECTOR2, VECTOR3, VECTOR4 = "color3f", "float", "float2", "float3", "float4"
COLOR4, STRING, TOKEN, FILE, BOOL, INT = "color4f", "string", "token", "asset", "bool", "int"


class Output(NamedTuple):
    """An output of a shader of the same network. As the source of an input, `type` is that of the input."""

    shader: str
    name: str
    type: str


class Constant(NamedTuple):
    """A value of a USD type; `color_space`, by its name in MaterialX, of the values in a file."""

    type: str
    value: object
    color_space: str = ""


type Input = Output | Constant


@dataclass(frozen=True)
class Shader:
    """A node: its identifier in USD's shader registry, its inputs by name, and its only output."""

    identifier: str
    inputs: dict[str, Input]
    output: Output


@dataclass
class Network:
    """Shaders by name, sources first; each name begins with `prefix`. The last shader is the surface."""

    prefix: str
    shaders: dict[str, Shader] = field(default_factory=dict)

    def add(self, name: str, identifier: str, kind: str, output: str = "out", **inputs: Input) -> Output:
        """Add a shader whose `output` is of type `kind`, and return that output."""
        name = f"{self.prefix}{name}"
        self.shaders[name] = Shader(identifier, inputs, Output(name, output, kind))
        return self.shaders[name].output

    @property
    def surface(self) -> Output:
        return list(self.shaders.values())[-1].output
