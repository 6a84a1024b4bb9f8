# SPDX-License-Identifier: GPL-3.0-or-later
"""A True Diffuse material as plain values: what is read from Blender, written to USD and glTF, and read back."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

type Rgb = tuple[float, float, float]
type Setting = float | str | tuple[float, ...]

KEY = "trueDiffuse"  # of the custom data on a material in USD
MIDDLE = 0.5  # stands for the values of a texture where what they go through is not linear


@dataclass(frozen=True)
class Image:
    """An image texture. `file` as USD refers to it, `primvar` the UV map's name there; `factor` times its values."""

    file: str
    is_color: bool
    """Whether its values are sRGB-encoded color, else they are data."""
    primvar: str
    wrap: str
    """periodic, clamp, mirror or black, as both MaterialX and UsdUVTexture know them."""
    factor: float = 1.0


@dataclass(frozen=True)
class Attribute:
    """A color attribute of the mesh, linear, by its name in USD; `factor` times its values."""

    primvar: str
    factor: float = 1.0


type Source = Image | Attribute


@dataclass(frozen=True)
class Surface:
    """A node of one of our groups: `group` its key, `inputs` all of its sockets by name, `fed` what varies over the surface.

    A socket in `fed` is in `inputs`, too, with the value it has beside its texture.
    """

    group: str
    version: int
    inputs: Mapping[str, Setting]
    fed: Mapping[str, Source] = field(default_factory=dict)

    def number(self, name: str) -> float:
        """Return a socket's number."""
        value = self.inputs[name]
        if not isinstance(value, (int, float)):
            raise TypeError(f"{name} is {value!r}, not a number")
        return float(value)

    def rgb(self, name: str) -> Rgb:
        """Return a socket's red, green and blue, or its vector."""
        try:
            return rgb(self.inputs[name])
        except TypeError as error:
            raise TypeError(f"{name}: {error}") from error

    def choice(self, name: str) -> str:
        """Return the entry of a menu."""
        return str(self.inputs[name])


def rgb(value: Setting) -> Rgb:
    """Return red, green and blue of a color, or a vector; raises TypeError for what is neither."""
    if not isinstance(value, tuple) or len(value) < 3:
        raise TypeError(f"{value!r} is not a color")
    return value[0], value[1], value[2]


def slope(law: Callable[[float], float]) -> float:
    """Return the factor that stands for `law` where a texture feeds it: exact where it is linear."""
    return law(MIDDLE) / MIDDLE
