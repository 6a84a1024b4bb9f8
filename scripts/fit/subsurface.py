# SPDX-License-Identifier: GPL-3.0-or-later
"""Finds the numbers of addon/closures/subsurface_fit.py, from the exact reflectance of a half-space and from random walks.

uv run scripts/fit/subsurface.py        some minutes: prints them, with how far they are off
"""

import math
import random
import sys
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes the checkout the package true_diffuse
from true_diffuse.addon.closures.subsurface_fit import BEAM, MU, SKIN_IOR, eevee_profile, rational
from true_diffuse.addon.models.burley import EDGE_WIDTH_25_75, searchlight_mfp
from true_diffuse.addon.models.half_space import diffuse_albedo, diffusion_root, plane_albedo
from true_diffuse.scripts.cli.console import Parser, end, script_arguments
from true_diffuse.scripts.fit.least_squares import rational_fit
from true_diffuse.scripts.studies.random_walk import Exit, exits

COLORS = tuple(k / 40 for k in range(1, 40))
ROOTS = (0.97, 0.9, 0.8, 0.65, 0.5, 0.4, 0.3, 0.22, 0.15, 0.1, 0.06, 0.04, 0.025, 0.015)  # s = sqrt(1 - alpha) of the walks
WIDTH_TERMS, SHRINKING_TERMS = (3, 1), (3, 2)
SKIN_MU = 0.949  # mean cosine of the half of the light that enters by refraction at SKIN_IOR and roughness 1, seen along the normal

SLAB_COLORS = (0.02, 0.05, 0.1, 0.15, 0.24, 0.34, 0.42, 0.5, 0.57, 0.64, 0.72, 0.8, 0.9, 0.99)
DEPTHS = tuple(0.1 * k for k in range(1, 400))  # mean free paths
DIM = 0.05


def wrenninge(color: float) -> float:
    """Return the alpha that Cycles' older random walks make of a color."""
    blend = color**0.25
    dark = 1.8260523782 * math.atan(5.1124679 * color) ** 1.09686102424
    light = 0.496310210422 * math.atan(4.2350090 * color) ** 2.40602999408
    return (1.0 - blend) * dark + blend * light


def shrinking(color: float) -> float:
    """Return q = sqrt(3 (1 - alpha')) of the standard dipole that reflects `color`, with Jensen's F_dr, as Cycles finds it."""
    f_dr = -1.440 / SKIN_IOR**2 + 0.710 / SKIN_IOR + 0.668 + 0.0636 * SKIN_IOR
    four_thirds_a = 4.0 / 3.0 * (1.0 + f_dr) / (1.0 - f_dr)
    return bisect(
        lambda q: 0.5 * (1.0 - q * q / 3.0) * (1.0 + math.exp(-four_thirds_a * q)) * math.exp(-q), color, math.sqrt(3.0), 0.0
    )


def bisect(f: Callable[[float], float], wanted: float, low: float, high: float) -> float:
    """Return the x between `low` and `high` at which `f`, rising from low to high, is `wanted`."""
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if f(middle) < wanted else (low, middle)
    return low


def skin_reflectance(s: float) -> float:
    """Return what Random Walk (Skin) reflects along the normal, for alpha = 1 - s^2."""
    alpha = 1.0 - s * s
    return 0.5 * diffuse_albedo(alpha) + 0.5 * plane_albedo(alpha, SKIN_MU)


def width(walks: Iterable[list[Exit]]) -> tuple[float, float]:
    """Return what walks reflect together, and how wide the edge of a shadow is, from 25 to 75 % [mean free paths].

    The edge's slope is the distribution of x, which is that of y.
    """
    places = sorted((abs(place), one.weight) for found in walks for one in found for place in (one.x, one.y))
    total = sum(weight for _, weight in places)
    below = 0.0
    for place, weight in places:
        below += weight
        if below >= 0.5 * total:
            return 0.5 * total, 2.0 * place
    return 0.0, 0.0


def transmitted(alpha: float, paths: int, seed: int = 1) -> list[float]:
    """Return the fraction of a beam along the normal that comes through index-matched slabs of DEPTHS.

    A walk comes through a slab if it gets as deep in a half-space before it leaves.
    """
    roll, reached = random.Random(seed).random, [0.0] * (len(DEPTHS) + 1)
    for _ in range(paths):
        z, mu, weight, slabs = 0.0, 1.0, 1.0, 0
        while weight > 0.0:
            z -= mu * math.log(1.0 - roll())
            if z < 0.0:
                break
            while slabs < len(DEPTHS) and DEPTHS[slabs] <= z:
                reached[slabs] += weight
                slabs += 1
            weight *= alpha
            if weight < 0.1:
                weight = 2.0 * weight if roll() < 0.5 else 0.0
            mu = 2.0 * roll() - 1.0
    return [value / paths for value in reached[:-1]]


def through(color: float, paths: int) -> float:
    """Return the radius of `subsurface_fit.through_radius` for a `color`: the least relative squares of what comes through slabs.

    What is dimmer than a fraction DIM of what the medium reflects counts no more than that.
    """
    alpha = min(BEAM.albedo(color), 0.9999)
    seen = transmitted(alpha, paths)

    def apart(radius: float) -> float:
        pairs = zip(DEPTHS, seen, strict=True)
        return sum(((color * eevee_profile(depth / radius) - value) / max(value, DIM * color)) ** 2 for depth, value in pairs)

    return min((0.1 * k for k in range(20, 420)), key=apart) * (1.5 - 0.3 * diffusion_root(alpha))


def show(name: str, coefficients: Sequence[float], above: int, points: Sequence[tuple[float, float]]) -> None:
    """Print numbers as the module has them, and the largest relative error."""
    error = max(abs(rational(coefficients, above, x) / y - 1.0) for x, y in points)
    print(f"{name} = ({', '.join(f'{value:.5g}' for value in coefficients)})  # to {100.0 * error:.2f} %", flush=True)


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="fit/subsurface.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--paths", type=int, default=60_000, metavar="N", help="random walks of each albedo (default: 60000)")
    paths = parser.parse_args(script_arguments()).paths
    beam = [(s, plane_albedo(1.0 - s * s, MU)) for s in (k / 100 for k in range(1, 100))]
    print(f"BEAM is within {100.0 * max(abs(BEAM.reflectance(s) / r - 1.0) for s, r in beam):.4f} %")

    legacy = [(color, bisect(wrenninge, 1.0 - BEAM.s(color) ** 2, 0.0, 1.0) / color) for color in COLORS]
    show("LEGACY", rational_fit(legacy, 6, 0), 6, legacy)
    roots = {color: bisect(skin_reflectance, color, 1.0, 0.0) for color in COLORS}
    skin = [(color, bisect(wrenninge, 1.0 - roots[color] ** 2, 0.0, 1.0) / color) for color in COLORS]
    show("SKIN", rational_fit(skin, 6, 0), 6, skin)

    widths = []
    for s in ROOTS:
        count = round(paths / (1.0 - s))  # few come out where it is dark
        color, wide = width(exits(1.0 - s * s, mu_i=MU, paths=count))
        widths.append((color / count, wide))
    found = rational_fit(widths, *WIDTH_TERMS)
    show("WIDTH", found, WIDTH_TERMS[0], widths)
    apart = ", ".join(f"{c:.2f}: {100.0 * (EDGE_WIDTH_25_75 / searchlight_mfp(c) / wide - 1.0):+.1f}" for c, wide in widths)
    print(f"Burley's map for a beam is off by, at colors, in %: {apart}", flush=True)

    shrunk = []
    for s in ROOTS:
        alpha, half = 1.0 - s * s, round(0.5 * paths / (1.0 - s))
        color, wide = width(chain(exits(alpha, paths=half), exits(alpha, mu_i=SKIN_MU, paths=half)))
        color /= 2 * half
        wider = wide / rational(found, WIDTH_TERMS[0], color)
        shrunk.append((color, wider * shrinking(bisect(wrenninge, alpha, 0.0, 1.0))))
    show("SKIN_SHRINKING", rational_fit(shrunk, *SHRINKING_TERMS), SHRINKING_TERMS[0], shrunk)

    slabs = [(color, through(color, round(0.2 * paths * (1.0 - 0.9 * color)))) for color in SLAB_COLORS]
    show("THROUGH", rational_fit(slabs, 5, 0), 5, slabs)
    return 0


if __name__ == "__main__":
    end(main())
