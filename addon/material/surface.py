# SPDX-License-Identifier: GPL-3.0-or-later
"""A True Diffuse material as plain values, which all targets read: USD, glTF, Realtime. No bpy."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace

type Rgb = tuple[float, float, float]
type Setting = float | str | tuple[float, ...]


@dataclass(frozen=True)
class Image:
    """An image texture whose values are multiplied by `factor`; `file` and the UV map `primvar` are named as the target does."""

    file: str
    is_color: bool
    """Whether the values are sRGB-encoded color; else they are linear data."""
    primvar: str
    wrap: str
    """periodic, clamp, mirror or black."""
    factor: float = 1.0


@dataclass(frozen=True)
class Attribute:
    """A linear color attribute of the mesh, named as the target does, whose values are multiplied by `factor`."""

    primvar: str
    factor: float = 1.0


type Source = Image | Attribute


@dataclass(frozen=True)
class GroupInputs:
    """A node of one of our groups: the `group`'s key and the values of all `inputs` by name."""

    group: str
    inputs: Mapping[str, Setting]

    def number(self, name: str) -> float:
        """Return the value of a number input; raises TypeError where it is of another type."""
        value = self.inputs[name]
        if not isinstance(value, (int, float)):
            raise TypeError(f"{name} is {value!r}, not a number")
        return float(value)

    def rgb(self, name: str) -> Rgb:
        """Return the value of a color or vector input; raises TypeError where it is of another type."""
        try:
            return rgb(self.inputs[name])
        except TypeError as error:
            raise TypeError(f"{name}: {error}") from error

    def choice(self, name: str) -> str:
        """Return the chosen entry of a menu; raises TypeError where the input is no menu."""
        value = self.inputs[name]
        if not isinstance(value, str):
            raise TypeError(f"{name} is {value!r}, not an entry of a menu")
        return value


@dataclass(frozen=True)
class Surface(GroupInputs):
    """A node of a `version` of one of our groups, and what is linked to its inputs.

    Inputs in `linked` and `unreadable` are in `inputs` too, with the socket's own value.
    """

    version: int
    linked: Mapping[str, Source] = field(default_factory=dict)
    unreadable: Mapping[str, str] = field(default_factory=dict)
    """Descriptions of links to anything but an image, a color attribute or a constant, each times a constant."""

    def supported(self, images: Collection[str], attributes: Collection[str]) -> tuple["Surface", list[str]]:
        """Return the surface as a target can hold it, and a message for each link that it cannot.

        `images` and `attributes` name the inputs for which the target supports image textures and color attributes.
        """
        unsupported = dict(self.unreadable)
        for name, source in self.linked.items():
            if isinstance(source, Image) and name not in images:
                unsupported[name] = f"the image {source.file}"
            elif isinstance(source, Attribute) and name not in attributes:
                unsupported[name] = f"the color attribute {source.primvar}"
        linked = {name: source for name, source in self.linked.items() if name not in unsupported}
        messages = [f"{name}: {what} is not supported, the socket's own value is written" for name, what in unsupported.items()]
        return replace(self, linked=linked, unreadable={}), messages


def rgb(value: Setting) -> Rgb:
    """Return the first three components of a color or vector; raises TypeError where `value` is neither."""
    if not isinstance(value, tuple) or len(value) < 3:
        raise TypeError(f"{value!r} is not a color")
    return value[0], value[1], value[2]


def texture_factor(function: Callable[[float], float]) -> float:
    """Return the factor that replaces `function` where a target can only scale a texture: exact for 0.5 and where it is linear."""
    return function(0.5) / 0.5
