# SPDX-License-Identifier: GPL-3.0-or-later
"""Color spaces and views, known by what Blender's OpenColorIO configuration computes rather than by names, which may be any.

A space has the name in MaterialX 1.39 of the one that gives the same linear Rec. 709 for a few colors, through the configuration's
exchange roles, or where it lacks them through its scene_linear, taken for linear Rec. 709. Some builds of Blender, as Debian's,
lack Python's module of OpenColorIO: there the names of Blender's own configuration count.
"""

import importlib.util
import math
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
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
# By the names in Blender's own configuration
OF_BLENDER = {"sRGB": SRGB, "Linear Rec.709": "lin_rec709", "ACEScg": "acescg"}
PLAIN_VIEW = "Standard"
GRAYS = (0.02, 0.18, 0.5, 0.9)


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


def is_data(image: bpy.types.Image) -> bool:
    """Return whether the pixels of an image are numbers: Blender says so of one space alone, of which a studio may have several."""
    settings = image.colorspace_settings
    if settings.is_data or not os.environ.get("OCIO") or not _has_open_color_io():
        return settings.is_data
    space = _current().getColorSpace(settings.name)
    return bool(space and space.isData())


def is_srgb(image: bpy.types.Image) -> bool:
    """Return whether the pixels of an image are colors as sRGB encodes them."""
    return not is_data(image) and name(image.colorspace_settings.name) == (SRGB, True)


def show_plainly(scene: bpy.types.Scene) -> None:
    """Give a scene the view of its display that encodes colors and no more, whose grays are the nearest to those of sRGB."""
    view = PLAIN_VIEW
    if _has_open_color_io():
        display = scene.display_settings.display_device
        view = min(_current().getViews(display), key=lambda each: _gray_error(display, each))
    with suppress(TypeError):  # another configuration than Blender's, and no module to ask it
        scene.view_settings.view_transform = view


def interop_id(color_space: str) -> str:
    """Return the name of a color space that color management systems share; empty where the configuration does not tell."""
    if not _has_open_color_io():
        return ""
    space = _current().getColorSpace(color_space)
    return space.getInteropID() if space else ""


@cache
def _configuration(path: str) -> "PyOpenColorIO.Config":
    """Return a file's configuration, or OpenColorIO's own, as ocio://default; Blender's where it has refused that."""
    import PyOpenColorIO

    names = bpy.types.ColorManagedInputColorspaceSettings.bl_rna.properties["name"].enum_items.keys()
    with suppress(PyOpenColorIO.Exception, PyOpenColorIO.ExceptionMissingFile):
        config = PyOpenColorIO.Config.CreateFromFile(path)
        if all(config.getColorSpace(name) for name in names):
            return config
    own = Path(bpy.utils.system_resource("DATAFILES")) / "colormanagement" / "config.ocio"
    return PyOpenColorIO.Config.CreateFromFile(str(own))


def _has_open_color_io() -> bool:
    bpy.utils.expose_bundled_modules()
    return importlib.util.find_spec("PyOpenColorIO") is not None


def _current() -> "PyOpenColorIO.Config":
    """Return the configuration that Blender has."""
    return _configuration(os.environ.get("OCIO", ""))


def _gray_error(display: str, view: str) -> float:
    """Return how far the grays of a view are from sRGB's, as encoded values."""
    import PyOpenColorIO

    transform = PyOpenColorIO.DisplayViewTransform(src="scene_linear", display=display, view=view)
    processor = _current().getProcessor(transform).getDefaultCPUProcessor()
    shown = ((gray, processor.applyRGB([gray] * 3)) for gray in GRAYS)
    return max(abs(_srgb(channel) - gray) for gray, color in shown for channel in color)


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
