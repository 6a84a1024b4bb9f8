# SPDX-License-Identifier: GPL-3.0-or-later
"""A shading network as plain values, in USD's terms: shaders with an identifier, inputs with a type, connections."""

from dataclasses import dataclass, field
from typing import NamedTuple

COLOR, FLOAT, VECTOR2, VECTOR3, VECTOR4 = "color3f", "float", "float2", "float3", "float4"
COLOR4, STRING, TOKEN, FILE, BOOL, INT = "color4f", "string", "token", "asset", "bool", "int"


class Output(NamedTuple):
    """An output of a shader of the same network. Where it goes into an input, `type` is the input's."""

    shader: str
    name: str
    type: str


class Constant(NamedTuple):
    """A value of a USD type by its name there; `color_space` of a file's values, as MaterialX names it."""

    type: str
    value: object
    color_space: str = ""


type Input = Output | Constant


@dataclass(frozen=True)
class Shader:
    """A node: its identifier in the registry of shaders, and what goes in."""

    identifier: str
    inputs: dict[str, Input]
    output: Output


@dataclass
class Network:
    """Shaders by name; each name begins with `prefix`. The last one added is the surface."""

    prefix: str
    shaders: dict[str, Shader] = field(default_factory=dict)

    def add(self, name: str, identifier: str, kind: str, output: str = "out", **inputs: Input) -> Output:
        """Add a shader whose `output` is of type `kind`; returns the output."""
        name = f"{self.prefix}{name}"
        result = Output(name, output, kind)
        self.shaders[name] = Shader(identifier, inputs, result)
        return result

    @property
    def surface(self) -> Output:
        return list(self.shaders.values())[-1].output
