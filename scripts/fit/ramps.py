# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the ramps of shaders/rough_diffuse.osl to the models, by least squares over all lights and views.

No ramp is negative anywhere.

uv run scripts/fit/ramps.py
"""

import math
import sys
from collections.abc import Callable, Collection, Sequence
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon.closures.lobe import cycles_bump_shadowing
from true_diffuse.addon.models import OrenNayar1994, Pitted
from true_diffuse.addon.models.fujii import SHAPE
from true_diffuse.addon.models.oren_nayar_1994 import FACETS, INTERREFLECTION
from true_diffuse.addon.models.pitted import ONCE
from true_diffuse.addon.models.terms import relative_radiance
from true_diffuse.addon.models.vector import Vector, dot, from_polar
from true_diffuse.scripts.cli.console import Parser, end, script_arguments
from true_diffuse.scripts.fit.least_squares import dot as dot_product
from true_diffuse.scripts.fit.least_squares import solve
from true_diffuse.scripts.fit.lobes import ORDER, VIEWS, lights

KNOTS = 7  # the values of a ramp, at M.L = 1/7, 2/7 ... 1; at 0 it is 0
FAR, NEAR = math.radians(89.5), math.radians(65.0)  # from N, away from the viewer
NEAR_STARTS = 3  # the near ramp's first values that stay 0: so it is 0 wherever s >= 0
BESIDE = math.radians(80.0)  # from N, square to the viewer
TOWARDS = 0.75  # of the viewer's angle from N
RIDGE = 1e-6  # keeps numbers small that the light hardly tells apart
SLIGHT = 1e-9  # a gain that is none

type Function = Callable[[Vector, float], float]  # of L in the frame (V_t, N x V_t, N), and mu
type Closures = Callable[[Vector, float], Sequence[float]]  # what each gives for L in the frame (V_t, N x V_t, N), and mu
type Blend = Callable[[float], Sequence[float]]  # the functions of mu whose sum is a closure's weight


def ramp(m: Vector, l: Vector) -> list[float]:
    """Return what each value of a ramp around `m` adds for light from `l`, as Cycles shades it."""
    m_dot_l = min(1.0, dot(m, l))
    shadow = 1.0 if m[2] == 1.0 else cycles_bump_shadowing(l[2], m[2], m_dot_l)
    return [shadow * max(0.0, 1.0 - abs(KNOTS * m_dot_l - k)) if m_dot_l > 0.0 else 0.0 for k in range(1, KNOTS + 1)]


def away_closures(l: Vector, _mu: float) -> Sequence[float]:
    """The two ramps away from the viewer."""
    far, near = (from_polar(math.cos(angle), math.pi) for angle in (FAR, NEAR))
    return *ramp(far, l), *ramp(near, l)[NEAR_STARTS:]


def closures_1994(l: Vector, mu: float) -> Sequence[float]:
    """z, F, the ramp around N, and half of the ramp to either side."""
    one, other = (ramp(from_polar(math.cos(BESIDE), azimuth), l) for azimuth in (0.5 * math.pi, -0.5 * math.pi))
    beside = (0.5 * (a + b) for a, b in zip(one, other, strict=True))
    return l[2], SHAPE.value(l, mu), *ramp((0.0, 0.0, 1.0), l), *beside


def pitted_closures(l: Vector, mu: float) -> Sequence[float]:
    """z + F, the ramp around N, and the one towards the viewer."""
    towards = from_polar(math.cos(TOWARDS * math.acos(mu)), 0.0)
    return l[2] + SHAPE.value(l, mu), *ramp((0.0, 0.0, 1.0), l), *ramp(towards, l)


def sine_blend(mu: float) -> Sequence[float]:
    """A number for mu = 0 and one for mu = 1, linear in between, times sin."""
    sine = math.sqrt(1.0 - mu * mu)
    return sine * (1.0 - mu), sine * mu


def blend(mu: float) -> Sequence[float]:
    """A number for mu = 0 and one for mu = 1, linear in between."""
    return 1.0 - mu, mu


def fit(
    target: Function,
    whole: Function,
    closures: Closures,
    blend: Blend,
    signed: Collection[int] = (),
    views: Sequence[int] = VIEWS,
) -> list[list[float]]:
    """Return the numbers of each closure whose sum is nearest to `target`: only closures in `signed` may have negative ones.

    What is least is the square of the error over the square of `whole`, each summed over the lights, summed over `views`: degrees
    from N.
    """
    directions = lights(ORDER)
    width = len(blend(1.0))
    size = width * len(closures((0.0, 0.0, 1.0), 1.0))
    gram, right = [[0.0] * size for _ in range(size)], [0.0] * size
    for view in views:
        mu = math.cos(math.radians(view))
        shares = blend(mu)
        total = sum(solid_angle * whole(l, mu) ** 2 for l, solid_angle in directions)
        for l, solid_angle in directions:
            values = [value * share for value in closures(l, mu) for share in shares]
            row = [(k, value) for k, value in enumerate(values) if value]
            wanted = target(l, mu)
            for i, value in row:
                line, weighted = gram[i], value * solid_angle / total
                right[i] += weighted * wanted
                for j, other in row:
                    line[j] += weighted * other
    for i in range(size):
        gram[i][i] = gram[i][i] * (1.0 + RIDGE) or 1.0  # a value that no light reaches stays 0
    x = nonnegative(gram, right, {width * k + i for k in signed for i in range(width)})
    return [x[k : k + width] for k in range(0, size, width)]


def nonnegative(gram: list[list[float]], right: list[float], signed: Collection[int]) -> list[float]:
    """Return x with the least x.gram x - 2 right.x, each x >= 0 but for those in `signed`.

    By C. Lawson and R. Hanson's active sets (1974).
    """
    x, used = [0.0] * len(right), set(signed)

    def least() -> list[float]:
        """Return the least over the numbers in `used`, of any sign; the others are 0."""
        order = sorted(used)
        result = [0.0] * len(right)
        for i, value in zip(order, solve([[gram[i][j] for j in order] for i in order], [right[i] for i in order]), strict=True):
            result[i] = value
        return result

    while True:
        while used:
            best = least()
            negative = [i for i in used if i not in signed and best[i] <= 0.0]
            if not negative:
                x = best
                break
            step, first = min((x[i] / (x[i] - best[i]) if x[i] > best[i] else 0.0, i) for i in negative)
            x = [a + step * (b - a) for a, b in zip(x, best, strict=True)]
            x[first] = 0.0
            used -= {i for i in negative if x[i] <= 0.0}
        scales = [math.sqrt(line[i]) for i, line in enumerate(gram)]
        gains = [(b - dot_product(line, x)) / scale for line, b, scale in zip(gram, right, scales, strict=True)]
        unused = [i for i in range(len(x)) if i not in used and gains[i] > SLIGHT]
        if not unused:
            return x
        used.add(max(unused, key=gains.__getitem__))


def fit_all() -> tuple[dict[str, list[float]], dict[str, list[float]]]:
    """Return the numbers of each ramp by its name in the shader, for mu = 0 and then for mu = 1, and those of z and F."""
    # z max(0, -x), of equation (1), is the same for every view
    darker = fit(lambda l, _: l[2] * max(0.0, -l[0]), lambda *_: 1.0, away_closures, lambda _: (1.0,), views=VIEWS[:1])
    away_values = [number for (number,) in darker]
    model = partial(relative_radiance, OrenNayar1994(1.0))

    def beside_fujii(l: Vector, mu: float) -> float:
        return FACETS.value(l, mu) - SHAPE.value(l, mu)

    once = fit(beside_fujii, model, closures_1994, sine_blend, signed=(0, 1))
    # Where N is not the mesh's normal, Cycles shadows what is bent away from either: z and F alone
    upright, twice = (
        fit(target, model, lambda l, mu: closures_1994(l, mu)[:2], sine_blend, signed=(0, 1))
        for target in (beside_fujii, INTERREFLECTION.value)
    )
    walls = partial(relative_radiance, Pitted())
    dark, white = (fit(target, walls, pitted_closures, blend) for target in (ONCE.value, walls))

    def both(rows: list[list[float]]) -> list[float]:
        return [row[i] for i in (0, 1) for row in rows]

    ramps = {"far": away_values[:KNOTS], "near": [0.0] * NEAR_STARTS + away_values[KNOTS:]}
    ramps |= {"around": both(once[2 : 2 + KNOTS]), "beside": both(once[2 + KNOTS :])}
    for name, rows in (("dark", dark), ("white", white)):
        ramps |= {f"{name}_around": both(rows[1 : 1 + KNOTS]), f"{name}_towards": both(rows[1 + KNOTS :])}
    pairs = {"upright z_0": upright[0], "z_0": once[0], "upright f_0": upright[1], "f_0": once[1]}
    return ramps, pairs | {"z_1": twice[0], "f_1": twice[1], "dark": dark[0], "white": white[0]}


def source(ramps: dict[str, list[float]], pairs: dict[str, list[float]]) -> str:
    """Return the numbers as the shader has them."""

    def numbers(values: Sequence[float]) -> str:
        return ", ".join(f"{value:.4g}" if value else "0.0" for value in values)

    lines = []
    for name, values in ramps.items():
        start = f"float {name}[{len(values)}] = {{ "
        rows = [numbers(values[k : k + KNOTS]) for k in range(0, len(values), KNOTS)]
        lines.append(start + (",\n" + " " * len(start)).join(rows) + " };")
    return "\n".join([*lines, *(f"{name}: mix({numbers(pair)}, mu)" for name, pair in pairs.items())])


def main() -> int:
    """Run the script; returns the exit status."""
    Parser(prog="fit/ramps.py", description=(__doc__ or "").splitlines()[0]).parse_args(script_arguments())
    print(source(*fit_all()))
    return 0


if __name__ == "__main__":
    end(main())
