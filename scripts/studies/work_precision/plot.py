# SPDX-License-Identifier: GPL-3.0-or-later
"""Curves of error over seconds as SVG, both axes logarithmic; colors are the page's CSS variables. No bpy."""

import math
from collections.abc import Sequence
from html import escape

from true_diffuse.addon.measure.record import Record
from true_diffuse.scripts.studies.work_precision.curves import TOLERANCES, seconds

WIDTH, HEIGHT = 420.0, 400.0  # of the drawing; text is legible where that is a phone's width
LEFT, RIGHT, TOP, BOTTOM = 46.0, 12.0, 12.0, 40.0
COLORS = 8  # in the page's style, --c0 and so on: told apart also without red or green
SHAPES = (  # of markers, in units of half their size
    "M1 0A1 1 0 1 1 -1 0A1 1 0 1 1 1 0Z",
    "M-.9-.9H.9V.9H-.9Z",
    "M0-1.2L1.1.8H-1.1Z",
    "M0-1.25L1.25 0L0 1.25L-1.25 0Z",
    "M0 1.2L1.1-.8H-1.1Z",
    "M-.4-1.2H.4V-.4H1.2V.4H.4V1.2H-.4V.4H-1.2V-.4H-.4Z",
    "M-1.2-.8L1.2-.8L.6 .9H-.6Z",
)
HALF = 4.0  # of a marker
LEAST = 1e-4  # errors below are drawn there: they are the engines' own rounding
STEPS = ((1.0,), (1.0, 2.0, 5.0), (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0))  # within a decade: the more, the fewer decades there are
FEW, FEWER = 2.6, 0.7


class Axis:
    """A logarithmic axis over `values`, all positive, from `start` to `end` of the drawing, with room at both ends."""

    def __init__(self, values: Sequence[float], start: float, end: float) -> None:
        low, high = math.log10(min(values)), math.log10(max(values))
        margin = 0.06 * max(high - low, 0.5)
        self.low, self.high, self.start, self.end = low - margin, high + margin, start, end

    def at(self, value: float) -> float:
        """Return the place of a value."""
        return self.start + (self.end - self.start) * (math.log10(value) - self.low) / (self.high - self.low)

    def ticks(self) -> list[float]:
        """Return the values that are marked."""
        decades = range(math.floor(self.low), math.ceil(self.high) + 1)
        span = self.high - self.low
        steps = STEPS[(span < FEW) + (span < FEWER)]
        every = [float(f"{step}e{decade}") for decade in decades for step in steps]
        return [value for value in every if self.low <= math.log10(value) <= self.high]


def style(index: int) -> tuple[str, str]:
    """Return the color and the marker's path of a curve; no two of 56 have both alike."""
    return f"var(--c{index % COLORS})", SHAPES[index % len(SHAPES)]


def marker(index: int, kind: str) -> str:
    """Return a marker at the origin: filled for ours, hollow for Blender's."""
    color, path = style(index)
    fill = color if kind == "ours" else "var(--paper)"
    return f'<path d="{path}" transform="scale({HALF})" fill="{fill}" stroke="{color}" stroke-width=".4"/>'


def key(index: int, kind: str) -> str:
    """Return a small drawing of a curve's line and marker, for a legend."""
    color, _ = style(index)
    return (
        '<svg class="key" viewBox="-14 -7 28 14" width="28" height="14" aria-hidden="true">'
        f'<path d="M-13 0H13" stroke="{color}" stroke-width="1.6"{_dash(kind)}/>{marker(index, kind)}</svg>'
    )


def _dash(kind: str) -> str:
    return "" if kind == "ours" else ' stroke-dasharray="5 3"'


def svg(curves: Sequence[Record], title: str) -> str:
    """Return the drawing of some curves, one at least: each with its spread, its floor, and rings around Pareto points."""
    points = [point for curve in curves for point in curve["points"]]
    reference = max(curve["reference_error"] for curve in curves)
    errors = [max(LEAST, error) for point in points for error in (point["error_low"], point["error_high"])]
    errors += [max(LEAST, curve["floor"]) for curve in curves if curve["floor"] > 0.1 * min(errors)]
    x = Axis([t for point in points for t in (point["seconds_low"], point["seconds_high"])], LEFT, WIDTH - RIGHT)
    y = Axis([*errors, TOLERANCES[-1]], HEIGHT - BOTTOM, TOP)
    lines = [
        f'<svg class="plot" viewBox="0 0 {WIDTH:g} {HEIGHT:g}" role="img" aria-label="{escape(title)}">',
        f"<title>{escape(title)}</title>",
    ]
    if reference > 0.0 and math.log10(reference) > y.low:
        top = y.at(reference)
        lines.append(f'<rect class="unknown" x="{LEFT}" y="{top:.1f}" width="{x.end - LEFT:g}" height="{y.start - top:.1f}"/>')
    lines += _axes(x, y)
    for index, curve in enumerate(curves):
        lines += _curve(index, curve, x, y)
    return "\n".join([*lines, "</svg>"])


def _axes(x: Axis, y: Axis) -> list[str]:
    lines = []
    tolerances = [tolerance for tolerance in TOLERANCES if y.low <= math.log10(tolerance) <= y.high]
    for value in sorted({*y.ticks(), *tolerances}):
        at, kind = y.at(value), "tolerance" if value in tolerances else "grid"
        lines.append(f'<path class="{kind}" d="M{LEFT} {at:.1f}H{x.end:g}"/>')
        lines.append(f'<text x="{LEFT - 5}" y="{at + 4:.1f}" text-anchor="end">{100.0 * value:g}%</text>')
    for value in x.ticks():
        at = x.at(value)
        lines.append(f'<path class="grid" d="M{at:.1f} {TOP}V{y.start:g}"/>')
        lines.append(f'<text x="{at:.1f}" y="{y.start + 16:g}" text-anchor="middle">{escape(seconds(value))}</text>')
    lines.append(f'<rect class="frame" x="{LEFT}" y="{TOP}" width="{x.end - LEFT:g}" height="{y.start - TOP:g}"/>')
    lines.append(f'<text x="{(LEFT + x.end) / 2:g}" y="{HEIGHT - 6:g}" text-anchor="middle">render time</text>')
    return lines


def _curve(index: int, curve: Record, x: Axis, y: Axis) -> list[str]:
    color, _ = style(index)
    kind, lowest = curve["kind"], 10.0**y.low
    places = [(x.at(point["seconds"]), y.at(max(point["error"], lowest))) for point in curve["points"]]
    lines = [f'<g class="curve"><title>{escape(curve["label"])}</title>']
    path = " ".join(f"{a:.1f},{b:.1f}" for a, b in places)
    lines.append(f'<polyline points="{path}" fill="none" stroke="{color}" stroke-width="1.6"{_dash(kind)}/>')
    if curve["slope"] is not None and curve["floor"] > lowest:
        last = places[-1][0]
        lines.append(f'<path d="M{last:.1f} {y.at(curve["floor"]):.1f}H{x.end:g}" stroke="{color}" stroke-dasharray="1 3"/>')
    for point, (a, b) in zip(curve["points"], places, strict=True):
        low, high = (y.at(max(point[name], lowest)) for name in ("error_low", "error_high"))
        left, right = x.at(point["seconds_low"]), x.at(point["seconds_high"])
        lines.append(f'<path class="spread" d="M{a:.1f} {low:.1f}V{high:.1f}M{left:.1f} {b:.1f}H{right:.1f}" stroke="{color}"/>')
        ring = f'<circle class="pareto" r="{2.0 * HALF:g}"/>' if point["pareto"] else ""
        lines.append(f'<g transform="translate({a:.1f} {b:.1f})">{ring}{marker(index, kind)}</g>')
    lines.append("</g>")
    return lines
