# SPDX-License-Identifier: GPL-3.0-or-later
"""The plots in the panels, drawn in plain Python into previews: a lobe over the angle of view, the radial profile below a surface.

They have a dark background, so that they look the same in every theme. A plot is drawn again only when its inputs change.
"""

import math
from array import array
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING

import bpy
import bpy.utils.previews

if TYPE_CHECKING:
    from ..blender.engines import Engine
    from ..material.summary import MaterialSummary

type Color = tuple[int, int, int]
type Points = Sequence[tuple[float, float]]

SIZE = 288  # pixels each way: sharp in a panel at Resolution Scale 1, and nearly so at 1.5
BORDER = 12.0  # pixels around the axes
SWATCH = 32  # pixels each way, of a line of the legend
GROUND, GRID, AXIS, IDEAL = (38, 38, 40), (62, 62, 66), (120, 120, 124), (150, 150, 154)
LIGHTS: tuple[tuple[float, Color], ...] = ((0.0, (240, 240, 236)), (30.0, (255, 190, 90)), (60.0, (100, 180, 255)))
CHANNELS: dict[str, Color] = {"Red": (255, 105, 95), "Green": (110, 215, 110), "Blue": (110, 155, 255)}
MODEL = LIGHTS[0][1]  # of the legend's line of the model, whose own lines have the colors of the lights
LINE, THIN, BOLD = 1.7, 0.9, 2.5  # half widths in pixels
DOT = 6.0  # radius in pixels
STEP = 3  # degrees between views
VIEW = 87  # the last view drawn [degrees]
DASH = 2  # steps between points that a dash is long, and the gap after it
TOP = 1.5  # of the lobe's axis: radiance over Lambert's, both lit at normal incidence
DECADES = 4  # of the profile's axis
FRACTION = 0.95  # of the light of the widest channel: as far as the profile's axis goes
PROFILE_POINTS = 60
KEPT = 32  # plots

_plots: bpy.utils.previews.ImagePreviewCollection  # while the extension is registered
_keys: dict[object, str] = {}  # names of previews by what they show, the oldest first


class Canvas:
    """A square picture with its axes; x and y of points are fractions of the axes, from the bottom left."""

    def __init__(self, size: int = SIZE) -> None:
        self.size = size
        self.pixels = bytearray(bytes((*GROUND, 255)) * (size * size))

    def pixel(self, x: float, y: float) -> tuple[float, float]:
        """Return the position in pixels of a point of the axes."""
        border = BORDER * self.size / SIZE
        length = self.size - 1.0 - 2.0 * border
        return border + length * x, border + length * y

    def line(self, points: Points, color: Color, half: float = LINE) -> None:
        """Draw a line through `points`."""
        pixels = [self.pixel(x, y) for x, y in points]
        for (x0, y0), (x1, y1) in pairwise(pixels):
            self._segment(x0, y0, x1, y1, color, half)

    def dashes(self, points: Points, color: Color, half: float = LINE) -> None:
        """Draw a dashed line through `points`."""
        for first in range(0, len(points) - 1, 2 * DASH):
            self.line(points[first : first + DASH + 1], color, half)

    def dot(self, x: float, y: float, color: Color, radius: float = DOT) -> None:
        """Draw a disc."""
        x, y = self.pixel(x, y)
        self._segment(x, y, x, y, color, radius)

    def _segment(self, x0: float, y0: float, x1: float, y1: float, color: Color, half: float) -> None:
        """Draw a line segment. A pixel's coverage is how far its center lies inside the edge plus half a pixel, in [0, 1]."""
        pixels, size, reach = self.pixels, self.size, half + 0.5
        dx, dy = x1 - x0, y1 - y0
        square = dx * dx + dy * dy
        red, green, blue = color
        left, right = max(0, math.ceil(min(x0, x1) - reach)), min(size - 1, math.floor(max(x0, x1) + reach))
        bottom, top = max(0, math.ceil(min(y0, y1) - reach)), min(size - 1, math.floor(max(y0, y1) + reach))
        for y in range(bottom, top + 1):
            for x in range(left, right + 1):
                t = ((x - x0) * dx + (y - y0) * dy) / square if square > 0.0 else 0.0
                t = 0.0 if t < 0.0 else min(t, 1.0)
                cover = reach - math.hypot(x - x0 - t * dx, y - y0 - t * dy)
                if cover > 0.0:
                    cover = min(cover, 1.0)
                    offset = 4 * (y * size + x)
                    pixels[offset] += int((red - pixels[offset]) * cover)
                    pixels[offset + 1] += int((green - pixels[offset + 1]) * cover)
                    pixels[offset + 2] += int((blue - pixels[offset + 2]) * cover)


def lobe(summary: "MaterialSummary", engine: "Engine | None") -> Canvas:
    """Draw radiance over the angle of view, in the plane of the light, for lights at LIGHTS, and dashed the lobes of `engine`.

    Gray lines are Lambert's. Views from -90 to 90 degrees; a dot marks each light. The albedo is the color's luminance.
    """
    from ..closures.lobes import Rendered
    from ..models.color import LUMINANCE
    from ..models.quadrature import NORMAL
    from ..models.vector import Vector

    def towards(degrees: float) -> Vector:
        angle = math.radians(degrees)
        return math.sin(angle), 0.0, math.cos(angle)

    albedo = min(1.0, max(0.02, sum(w * c for w, c in zip(LUMINANCE, summary.rgb(summary.socket("Color")), strict=True))))
    lobe_set = summary.lobe_set(engine) if engine else None
    lobes = Rendered(summary.model, lobe_set) if lobe_set else None
    canvas = _axes(3)
    for degrees, color in LIGHTS:
        l = towards(degrees)

        def curve(radiance: Callable[[Vector, Vector, Vector, float], float], l: Vector = l) -> Points:
            views = range(-VIEW, VIEW + 1, STEP)
            values = (math.pi * radiance(NORMAL, l, towards(view), albedo) / albedo / TOP for view in views)
            return [(0.5 + view / 180.0, min(1.05, value)) for view, value in zip(views, values, strict=True)]

        ideal = math.cos(math.radians(degrees)) / TOP
        canvas.line([(0.0, ideal), (1.0, ideal)], IDEAL, THIN)
        canvas.line(curve(summary.model.radiance), color)
        if lobes:
            canvas.dashes(curve(lobes.radiance), dimmed(color))
        canvas.dot(0.5 + degrees / 180.0, 0.0, color)
    return canvas


def profile_reach(summary: "MaterialSummary") -> float:
    """Return the distance [mm] up to which the profile is plotted: within it FRACTION of the widest channel's light comes out."""
    return max(burley.radius(FRACTION) for burley in _profiles(summary))


def profile(summary: "MaterialSummary") -> Canvas:
    """Draw R(r) of each channel times its color over the distance r, on a scale of DECADES, from 0 to `profile_reach`."""
    canvas, reach, color = _axes(DECADES), profile_reach(summary), summary.rgb("Color")
    curves = []
    for channel, burley in zip(color, _profiles(summary), strict=True):
        radii = [reach * ((k + 0.5) / PROFILE_POINTS) ** 2 for k in range(PROFILE_POINTS)] + [reach]
        curves.append([(r / reach, channel * burley.profile(r)) for r in radii])
    highest = max((value for curve in curves for x, value in curve if x >= 1e-3), default=0.0)
    for curve, shade in zip(curves, CHANNELS.values(), strict=True):
        seen = [(x, 1.0 + math.log10(value / highest) / DECADES) for x, value in curve if value > 0.0]
        canvas.line([(x, y) for x, y in seen if 0.0 <= y <= 1.02], shade)
    return canvas


def _profiles(summary: "MaterialSummary") -> list:
    """Return each channel's profile, that of the random walk (`closures/subsurface_fit.py`)."""
    from ..closures.subsurface_fit import edge_width
    from ..models.burley import EDGE_WIDTH_25_75, Burley

    lengths, scale = summary.rgb("Subsurface Radius"), summary.number("Scale")
    colors = summary.rgb("Color")
    return [Burley(length * scale * edge_width(color) / EDGE_WIDTH_25_75) for length, color in zip(lengths, colors, strict=True)]


def dimmed(color: Color) -> Color:
    """Return the color of the lobes for a model's line of that `color`."""
    red, green, blue = (channel // 2 + 50 for channel in color)
    return red, green, blue


def swatch(color: Color, mark: str = "line") -> int:
    """Return the icon of a plot's line of that color in a legend; `mark` is "line", "dashes" or "dot"."""

    def draw() -> Canvas:
        canvas = Canvas(SWATCH)
        if mark == "dot":
            canvas.dot(0.5, 0.5, color, 3.0 * BOLD)
        else:
            for start, end in ((0.0, 0.3), (0.7, 1.0)) if mark == "dashes" else ((0.0, 1.0),):
                canvas.line([(start, 0.5), (end, 0.5)], color, BOLD)
        return canvas

    return icon(("swatch", color, mark), draw)


def _axes(rows: int) -> Canvas:
    """Return a canvas with a grid of 6 columns and some rows."""
    canvas = Canvas()
    for k in range(1, 6):
        canvas.line([(k / 6, 0.0), (k / 6, 1.0)], GRID, THIN)
    for k in range(1, rows + 1):
        canvas.line([(0.0, k / rows), (1.0, k / rows)], GRID, THIN)
    canvas.line([(0.0, 0.0), (1.0, 0.0)], AXIS, THIN)
    canvas.line([(0.0, 0.0), (0.0, 1.0)], AXIS, THIN)
    return canvas


def icon(key: object, draw: Callable[[], Canvas]) -> int:
    """Return the icon of the plot that `draw` makes; it is drawn again only if the plot of `key` is no longer kept."""
    name = _keys.pop(key, None)
    if name is None:
        name = _keys.pop(next(iter(_keys))) if len(_keys) >= KEPT else str(len(_keys))
        preview = _plots.get(name) or _plots.new(name)
        canvas = draw()
        pixels = array("i", bytes(canvas.pixels))
        preview.image_size = preview.icon_size = canvas.size, canvas.size  # where it is large, and in a label
        preview.image_pixels.foreach_set(pixels)
        preview.icon_pixels.foreach_set(pixels)
    _keys[key] = name
    return _plots[name].icon_id


def register() -> None:
    global _plots
    _plots = bpy.utils.previews.new()


def unregister() -> None:
    _keys.clear()
    bpy.utils.previews.remove(_plots)
