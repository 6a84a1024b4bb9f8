# SPDX-License-Identifier: GPL-3.0-or-later
"""What feeds a channel of a material, read from Blender's nodes or from a file, so that both can be compared. No bpy.

A channel is a property that a feature lies on, whatever a target calls it: CHANNELS.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import reduce

# Words, in lower case, by one of which a report names a channel
CHANNELS: Mapping[str, tuple[str, ...]] = {
    "base color": ("base color", "color", "diffuse color"),
    "roughness": ("roughness",),
    "metallic": ("metallic", "metal"),
    "normal": ("normal", "bump"),
    "alpha": ("alpha", "opacity", "transparency", "transparent"),
    "emission": ("emission", "emissive"),
    "occlusion": ("occlusion",),
    "specular": ("specular", "highlight"),
    "anisotropy": ("anisotropy", "anisotropic", "tangent"),
    "coat": ("coat",),
    "sheen": ("sheen", "fuzz"),
    "transmission": ("transmission", "glass", "refraction"),
    "thin film": ("thin film",),
    "subsurface": ("subsurface",),
    "culling": ("culling",),
    "surface": ("surface",),
}
DEFAULT_UV_MAP = ""  # the active one
MISSING = "missing image"  # among a value's operations: an image node that has none
PLACES = ((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))

type Place = tuple[float, float]


@dataclass(frozen=True)
class ImageUse:
    """An image that a channel reads."""

    image: str
    channel: str
    """rgb, or one of r, g, b, a."""
    uv_map: str = DEFAULT_UV_MAP
    places: tuple[Place, ...] | None = PLACES
    """Where the UV coordinates PLACES are looked up, v from the bottom; None where that is no affine transform of a UV map."""


@dataclass(frozen=True)
class Value:
    """A factor times images times color attributes; `operations` names what else is done where it is more than that."""

    factor: tuple[float, ...] = (1.0, 1.0, 1.0)
    images: frozenset[ImageUse] = frozenset()
    attributes: frozenset[str] = frozenset()
    operations: frozenset[str] = frozenset()

    @property
    def is_constant(self) -> bool:
        return not self.images and not self.attributes and not self.operations

    @property
    def is_product(self) -> bool:
        return not self.operations

    def but(self, *operations: str) -> "Value":
        """Return it as a part of something that does `operations` to it, whose factor means nothing."""
        return replace(self, factor=(1.0, 1.0, 1.0), operations=self.operations | set(operations))

    def channel(self, name: str) -> "Value":
        """Return one of its channels, r, g, b or a."""
        if self.is_constant:
            index = min("rgba".index(name), len(self.factor) - 1)
            return constant(self.factor[index])
        images = frozenset(replace(use, channel=name if use.channel == "rgb" else use.channel) for use in self.images)
        return replace(self, images=images, factor=self.factor if len(set(self.factor[:3])) == 1 else (1.0, 1.0, 1.0))


def constant(value: float | Iterable[float]) -> Value:
    """Return a value that is the same everywhere; of a color its alpha is left out."""
    given = [float(value)] * 3 if isinstance(value, (int, float)) else [float(component) for component in value]
    red, green, blue = (given + given[-1:] * 3)[:3]
    return Value((red, green, blue))


def product(values: Iterable[Value]) -> Value:
    """Return the product of values."""
    return reduce(_times, values, Value())


def union(values: Iterable[Value], *operations: str) -> Value:
    """Return something that reads all `values` and does `operations` to them."""
    return product(value.but() for value in values).but(*operations)


def _times(one: Value, other: Value) -> Value:
    return Value(
        tuple(a * b for a, b in zip(one.factor, other.factor, strict=True)),
        one.images | other.images,
        one.attributes | other.attributes,
        one.operations | other.operations,
    )


def moved(transform: Callable[[float, float], Place], places: tuple[Place, ...] | None = PLACES) -> tuple[Place, ...] | None:
    """Return `places` after a transform."""
    return None if places is None else tuple(transform(*place) for place in places)


def identifier(name: str) -> str:
    """Return a name as it is compared between Blender and USD, which has letters, digits and underscores alone."""
    return re.sub(r"\W", "_", name)
