# SPDX-License-Identifier: GPL-3.0-or-later
"""The searchlight: where the light of a narrow beam leaves a slab, in Cycles and EEVEE, beside Burley and the standard dipole.

R(r) is the fraction of the beam's light that leaves at the distance r, per area [1 / mfp^2]; r is in mean free paths (mfp).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from itertools import pairwise
from statistics import fmean

from true_diffuse.addon.blender.engines import EEVEE, Engine
from true_diffuse.addon.closures import subsurface_fit
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models.burley import EDGE_WIDTH_25_75, Burley
from true_diffuse.addon.models.dipole import StandardDipole
from true_diffuse.addon.models.medium import Channel
from true_diffuse.addon.models.quadrature import integrate
from true_diffuse.scenes.slab import slab
from true_diffuse.scripts.studies import slab_light
from true_diffuse.scripts.studies.study import Step, Table, text
from true_diffuse.scripts.studies.subsurface import HALF_SPACE, METHODS, Method, material

ALBEDO = 0.8
RADII = tuple(0.1 * 100.0 ** (k / 12) for k in range(13))  # of rings, from 0.1 to 10
# EEVEE scatters in screen space, so its picture shows a spot of light and its surroundings in pixels a quarter of a mean free path
# wide: the rings from SCREEN_FIRST on. Its mean free path [mm] is long, as it stores radii in coarse steps.
SCREEN_SIZE, SCREEN_VIEW, SCREEN_PATH, SCREEN_FIRST = 161, 40.0, 100.0, 8
BURLEY, DIPOLE = "Burley, closed form", "Standard dipole"
COLORS = {BURLEY: "#111111", DIPOLE: "#999999"}
RENDERED = ("#c0392b", "#2471a3", "#8e44ad", "#b7950b", "#1e8449")
LEFT, RIGHT, TOP, BOTTOM = 80, 20, 20, 50  # of the diagram's frame [pixels]


def steps(used: Sequence[Engine], samples: Mapping[str, int]) -> list[Step]:
    """Return steps that yield, for each method and ring, the mean of R over it, as rendered, by Burley and by the standard dipole.

    `samples` is by the engine's key. The dipole has the medium of Random Walk, without a boundary.
    """
    burley = Burley(subsurface_fit.edge_width(ALBEDO) / EDGE_WIDTH_25_75)
    s = subsurface_fit.BEAM.s(ALBEDO)
    dipole = StandardDipole(Channel.from_albedo(1.0 - s * s, 1.0), 1.0)

    def measure(method: Method) -> Iterator[Record]:
        fractions = _fractions(method, samples[method.engine.key])
        for (inner, outer), fraction in zip(pairwise(RADII), fractions, strict=True):
            area = math.pi * (outer * outer - inner * inner)
            yield {
                "engine": method.engine.key,
                "method": method.label,
                "albedo": ALBEDO,
                "from_mfp": inner,
                "to_mfp": outer,
                "rendered": None if fraction is None else fraction / area,
                BURLEY: ALBEDO * (burley.cdf(outer) - burley.cdf(inner)) / area,
                DIPOLE: integrate(lambda r: 2.0 * math.pi * r * dipole.profile(r), (inner, outer), 16) / area,
                "samples": samples[method.engine.key],
            }

    return [Step(f"Searchlight  {method.name}", partial(measure, method)) for method in METHODS if method.engine in used]


def _fractions(method: Method, samples: int) -> list[float | None]:
    """Return the fraction of the beam's light in each ring, None where EEVEE's pixels are too wide."""
    path, first = (SCREEN_PATH, SCREEN_FIRST) if method.engine is EEVEE else (1.0, 0)
    shown, body = material(method, (ALBEDO,) * 3, (path,) * 3), slab(HALF_SPACE * path)
    radii = [path * r for r in RADII[first:]]
    if method.engine is EEVEE:
        rings = slab_light.around_spot(body, shown, method.engine, samples, SCREEN_SIZE, SCREEN_VIEW * path, radii)
    else:
        rings = slab_light.rings(body, shown, method.engine, samples, radii)
    return [None] * first + [fmean(channels) for channels in zip(*rings, strict=True)]


def curves(found: Sequence[Record]) -> dict[str, list[float | None]]:
    """Return the rings' values by curve: the closed forms and the renders."""
    result = {name: [record[name] for record in found[: len(RADII) - 1]] for name in COLORS}
    for record in found:
        result.setdefault(f"{record['engine']}, {record['method']}", []).append(record["rendered"])
    return result


def table(found: Sequence[Record]) -> Table:
    """Return R of each curve, a row for each ring."""
    columns = curves(found)
    rows: list[tuple[str, ...]] = [
        (f"{inner:.2f}", f"{outer:.2f}", *(text(values[k], ".3g") for values in columns.values()))
        for k, (inner, outer) in enumerate(pairwise(RADII))
    ]
    return ("From", "To, mfp", *columns), rows


def svg(found: Sequence[Record], width: int, height: int) -> str:
    """Return a diagram of all curves, R over r, both logarithmic."""
    columns = curves(found)
    middles = [math.sqrt(inner * outer) for inner, outer in pairwise(RADII)]
    positive = [value for values in columns.values() for value in values if value]
    decades = math.floor(math.log10(min(positive))), math.ceil(math.log10(max(positive)))

    def x(r: float) -> float:
        return LEFT + (width - LEFT - RIGHT) * math.log(r / RADII[0]) / math.log(RADII[-1] / RADII[0])

    def y(value: float) -> float:
        return TOP + (height - TOP - BOTTOM) * (decades[1] - math.log10(value)) / (decades[1] - decades[0])

    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" font-size="14">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for decade in range(decades[0], decades[1] + 1):
        at = y(10.0**decade)
        lines.append(f'<path d="M{LEFT} {at:.1f}H{width - RIGHT}" stroke="#ddd"/>')
        lines.append(f'<text x="{LEFT - 8}" y="{at + 5:.1f}" text-anchor="end">1e{decade}</text>')
    for r in (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0):
        lines.append(f'<path d="M{x(r):.1f} {TOP}V{height - BOTTOM}" stroke="#ddd"/>')
        lines.append(f'<text x="{x(r):.1f}" y="{height - BOTTOM + 18}" text-anchor="middle">{r:g}</text>')
    lines.append(f'<text x="{width / 2}" y="{height - 8}" text-anchor="middle">r in mean free paths</text>')
    lines.append(f'<text x="16" y="{height / 2}" text-anchor="middle" transform="rotate(-90 16 {height / 2})">R(r), mfp^-2</text>')
    colors = [*COLORS.values(), *RENDERED]
    for row, ((name, values), color) in enumerate(zip(columns.items(), colors, strict=False)):
        points = " ".join(f"{x(r):.1f},{y(value):.1f}" for r, value in zip(middles, values, strict=True) if value)
        dash = "" if name in COLORS else ' stroke-dasharray="6 4"'
        lines.append(f'<polyline points="{points}" fill="none" stroke="{color}" stroke-width="2"{dash}/>')
        at = height - BOTTOM - 20 * (len(columns) - row)
        lines.append(f'<path d="M{LEFT + 12} {at}h30" stroke="{color}" stroke-width="2"{dash}/>')
        lines.append(f'<text x="{LEFT + 50}" y="{at + 5}">{name}</text>')
    return "\n".join([*lines, "</svg>", ""])
