# SPDX-License-Identifier: GPL-3.0-or-later
"""The color spaces of images by their names in MaterialX 1.39, found by what Blender's OpenColorIO configuration computes.

A studio's configuration may have any names. So a space is known by the linear Rec. 709 that it gives for a few colors, through the
configuration's exchange roles, or where it lacks them through its scene_linear, taken for linear Rec. 709. Some builds of Blender,
as Debian's, lack Python's module of OpenColorIO: there the spaces of Blender's own configuration are known by their names.
"""

import importlib.util
import math
import os
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    import PyOpenColorIO

type Rgb = tuple[float, float, float]
type Rows = tuple[Rgb, Rgb, Rgb]

SRGB = "srgb_texture"
PROBES: tuple[Rgb, ...] = ((0.2, 0.5, 0.8), (0.9, 0.3, 0.1), (0.02, 0.7, 0.4))
TOLERANCE = 2e-3  # configurations round their matrices
# Of linear primaries to linear Rec. 709, from the chromaticities, adapted by Bradford's matrix (ISO 22028, SMPTE ST 2065-1)
XYZ_TO_REC709: Rows = (
    (3.2409699, -1.5373832, -0.4986108),
    (-0.9692436, 1.8759675, 0.0415551),
    (0.0556301, -0.2039770, 1.0569715),
)
AP0_TO_REC709: Rows = (
    (2.5216494, -1.1368886, -0.3849175),
    (-0.2752136, 1.3697052, -0.0943924),
    (-0.0159250, -0.1478064, 1.1638058),
)
AP1_TO_REC709: Rows = (
    (1.7050515, -0.6217907, -0.0832584),
    (-0.1302571, 1.1408029, -0.0105485),
    (-0.0240033, -0.1289688, 1.1529717),
)
P3_TO_REC709: Rows = ((1.2249402, -0.2249402, 0.0), (-0.0420570, 1.0420570, 0.0), (-0.0196376, -0.0786361, 1.0982735))
ADOBE_TO_REC709: Rows = ((1.3983557, -0.3983557, 0.0), (0.0, 1.0, 0.0), (0.0, -0.0429290, 1.0429290))
IDENTITY: Rows = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def _srgb(value: float) -> float:
    return value / 12.92 if value <= 0.04045 else ((value + 0.055) / 1.055) ** 2.4


def _gamma(exponent: float) -> Callable[[float], float]:
    return lambda value: value**exponent


# MaterialX's color spaces: how a channel is decoded, and the primaries
SPACES: Mapping[str, tuple[Callable[[float], float], Rows]] = {
    SRGB: (_srgb, IDENTITY),
    "lin_rec709": (float, IDENTITY),
    "g22_rec709": (_gamma(2.2), IDENTITY),
    "g18_rec709": (_gamma(1.8), IDENTITY),
    "rec709_display": (_gamma(2.4), IDENTITY),
    "acescg": (float, AP1_TO_REC709),
    "g22_ap1": (_gamma(2.2), AP1_TO_REC709),
    "srgb_displayp3": (_srgb, P3_TO_REC709),
    "lin_displayp3": (float, P3_TO_REC709),
    "adobergb": (_gamma(563.0 / 256.0), ADOBE_TO_REC709),
    "lin_adobergb": (float, ADOBE_TO_REC709),
}
OF_BLENDER = {"sRGB": SRGB, "Linear Rec.709": "lin_rec709", "ACEScg": "acescg"}  # by the names in Blender's configuration


def name(color_space: str) -> tuple[str, bool]:
    """Return the name in MaterialX of a color space of Blender's configuration, and whether that is it; else it is the nearest."""
    if not _has_open_color_io():
        return OF_BLENDER.get(color_space, SRGB), color_space in OF_BLENDER
    transform = _to_rec709(color_space)
    if transform is None:
        return SRGB, False
    found = [transform(probe) for probe in PROBES]

    def distance(entry: tuple[Callable[[float], float], Rows]) -> float:
        decode, rows = entry
        made = [_times(rows, tuple(map(decode, probe))) for probe in PROBES]
        return max(abs(a - b) for one, other in zip(found, made, strict=True) for a, b in zip(one, other, strict=True))

    nearest = min(SPACES, key=lambda each: distance(SPACES[each]))
    off = distance(SPACES[nearest])
    return nearest, math.isfinite(off) and off < TOLERANCE


def interop_id(color_space: str) -> str:
    """Return the name of a color space that color management systems share; empty where the configuration does not tell."""
    if not _has_open_color_io():
        return ""
    space = _current().getColorSpace(color_space)
    return space.getInteropID() if space else ""


@cache
def _configuration(path: str) -> "PyOpenColorIO.Config":
    import PyOpenColorIO

    return PyOpenColorIO.Config.CreateFromFile(path)


def _has_open_color_io() -> bool:
    bpy.utils.expose_bundled_modules()
    return importlib.util.find_spec("PyOpenColorIO") is not None


def _current() -> "PyOpenColorIO.Config":
    """Return the configuration that Blender has."""
    own = Path(bpy.utils.system_resource("DATAFILES")) / "colormanagement" / "config.ocio"
    path = os.environ.get("OCIO", "")
    return _configuration(path if path and Path(path).is_file() else str(own))


def _to_rec709(color_space: str) -> Callable[[Rgb], Rgb] | None:
    """Return the function from a color in a space to linear Rec. 709; None where the configuration does not tell."""
    config = _current()
    import PyOpenColorIO

    try:
        roles = {"cie_xyz_d65_interchange": XYZ_TO_REC709, "aces_interchange": AP0_TO_REC709, "scene_linear": IDENTITY}
        role = next(role for role in roles if config.hasRole(role))
        processor = config.getProcessor(color_space, role).getDefaultCPUProcessor()
    except (PyOpenColorIO.Exception, StopIteration):
        return None
    return lambda color: _times(roles[role], tuple(processor.applyRGB(list(color))))


def _times(rows: Rows, color: tuple[float, ...]) -> Rgb:
    red, green, blue = (sum(a * b for a, b in zip(row, color, strict=True)) for row in rows)
    return red, green, blue
