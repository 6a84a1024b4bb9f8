# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the lobes of addon/closures/lobe_table.py to the models, by linear least squares over all lights and views.

uv run scripts/fit/lobes.py --out addon/closures/lobe_table.py      seconds
uv run scripts/fit/lobes.py --search                              minutes: shows better directions, to be written below by hand
"""

import math
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes the checkout the package true_diffuse
from true_diffuse.addon.closures.lobe import CYCLES, PAIR, SIGNED, SINGLE, Fit, Lobe, Weight, fujii_function, lobe_values
from true_diffuse.addon.closures.lobe_error import lobe_error
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.models import Fujii, Model, OrenNayar, OrenNayar1994, Pits, Wolff
from true_diffuse.addon.models.quadrature import gauss_legendre
from true_diffuse.addon.models.vector import Vector, from_polar
from true_diffuse.scripts.cli.console import Parser, Terminal, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import run_script

N = (0.0, 0.0, 1.0)
VIEWS = tuple(range(5, 90, 5))  # degrees from N
SEARCH_ORDER = 12  # the same, for `search`
STEP, STEP_END, ENOUGH = 0.12, 0.01, 1e-6  # its steps, and what counts as better
ORDER = 24  # lights: this many elevations, and azimuths in half a circle, for each view
# How much a uniform world counts against lamps where the signed lobes are fitted: enough to make it right to 0.1 %.
WORLD = 1000.0
RIDGE = 1e-9  # keeps weights small that the light hardly tells apart

type Function = Callable[[Vector, float], float]  # of L in the frame (V_t, N x V_t, N), and mu


def of(model: Model, albedo: float = 1.0) -> Function:
    """Return `model` as a function, over (rho / pi) E0."""
    return lambda l, mu: math.pi / albedo * model.radiance(N, l, from_polar(mu, 0.0), albedo)


def oren_nayar(l: Vector, mu: float) -> float:
    """T, from equation (1) = A z + B T."""
    rough = OrenNayar(1.0)
    return (of(rough)(l, mu) - rough.a * l[2]) / rough.b


def fujii(l: Vector, mu: float) -> float:
    """F, from Fujii's model = A (z + r F)."""
    return fujii_function(l[0], l[2], mu)


def oren_nayar_1994(l: Vector, mu: float) -> float:
    """What the 1994 model has beside C1 z and the interreflection, over B: the parts in rho of rho (once + rho twice)."""
    rough = OrenNayar1994(1.0)
    once = 2.0 * of(rough, 0.5)(l, mu) - of(rough, 1.0)(l, mu)
    return (once - rough.a * l[2]) / rough.b


def interreflection(l: Vector, mu: float) -> float:
    """What the 1994 model's interreflection, over its factor, lacks to be z."""
    rough = OrenNayar1994(1.0)
    twice = 2.0 * (of(rough, 1.0)(l, mu) - of(rough, 0.5)(l, mu))
    return l[2] - twice / rough.interreflection


def pits(l: Vector, mu: float) -> float:
    """The light that pits reflect once; at rho = 1 the rest is z / 2."""
    return of(Pits())(l, mu) - 0.5 * l[2]


FACING = Lobe(0.0, 0.0, 1.0, 0.0, 0.0)
SIDEWAYS = Lobe(1.0, 0.0, 0.0, 0.0, 0.0)


def signed_lobes(near: float, far: float, side: float, under: float | None = None) -> tuple[Lobe, ...]:
    """Return the signed lobes whose creases lie at x = `near` z / mu and at x = `far` z / mu, the latter split by `side`."""
    lobes = (
        Lobe(0.0, 0.0, 0.0, 0.0, far),
        SIDEWAYS,
        Lobe(-1.0, 0.0, 0.0, 0.0, 0.0),
        Lobe(1.0, 0.0, 0.0, 0.0, -near),
        Lobe(-1.0, side, 0.0, 0.0, far),
    )
    return lobes if under is None else (*lobes, Lobe(-1.0, 0.0, -under, 0.0, 0.0))


def pair_lobes(up_0: float, up_1: float) -> tuple[Lobe, ...]:
    """Return a lobe around N and one bent towards the viewer, along V_t + (up_0 + up_1 mu) N."""
    return FACING, Lobe(1.0, 0.0, up_0, up_1, 0.0)


def lobes_of(scheme: str, directions: tuple[float, ...]) -> tuple[Lobe, ...]:
    """Return the lobes of a scheme, made of a family's numbers."""
    return pair_lobes(*directions) if scheme == PAIR else signed_lobes(*directions) if scheme == SIGNED else ()


class Family(NamedTuple):
    """Functions that occur together in a `model`, and the directions of their PAIR and SIGNED lobes, as found by `search`."""

    model: Model
    functions: dict[str, Function]
    pair: tuple[float, ...]
    signed: tuple[float, ...]

    def directions(self, scheme: str) -> tuple[float, ...]:
        """Return the numbers that a scheme's lobes are made of; the lobes of SINGLE and CYCLES are the engines' own."""
        return {PAIR: self.pair, SIGNED: self.signed}.get(scheme, ())


FAMILIES = {
    "oren_nayar": Family(OrenNayar(1.0), {"oren_nayar": oren_nayar}, (0.0, 0.63), (0.7, 0.98, 0.6)),
    "fujii": Family(Fujii(1.0), {"fujii": fujii}, (0.74, 1.14), (0.77, 1.0, 0.64, 0.85)),
    "oren_nayar_1994": Family(
        OrenNayar1994(1.0),
        {"oren_nayar_1994": oren_nayar_1994, "interreflection": interreflection},
        (1.07, 0.97),
        (0.8, 1.01, 0.51, 0.97),
    ),
    "pits": Family(Pits(), {"pits": pits}, (0.0, 2.46), (0.87, 0.79, 0.74, 0.74)),
}


def lights(order: int) -> list[tuple[Vector, float]]:
    """Return directions L above the surface, y > 0, with the solid angle of each (both halves together)."""
    result = []
    for node, weight in gauss_legendre(order):
        z = 0.5 + 0.5 * node
        for k in range(order):
            result.append((from_polar(z, math.pi * (k + 0.5) / order), math.pi * weight / order))
    return result


def unknowns_of(scheme: str, family: str, lobes: int) -> list[tuple[int, int]]:
    """Return the unknowns of a fit: (lobe, which number of its weight).

    All functions but that of pits vanish where V = N, and so do the lobes. Cycles has no negative weights: the lobe away from the
    viewer serves equation (1) alone.
    """
    if scheme == CYCLES:
        return [(1, 0), (2, 1)] if family == "oren_nayar" else [(k, power) for k in (0, 1) for power in range(4)]
    return [(k, power) for k in range(lobes) for power in range(4) if power > 0 or (family == "pits" and k == 0)]


def fit(scheme: str, family: str, lobes: tuple[Lobe, ...], order: int, views: Sequence[int]) -> Fit:
    """Return the least-squares weights of a family's functions; `order` and `views` [degrees from N] set how finely."""
    functions = FAMILIES[family].functions
    count = len(lobes) or (2 if scheme == SINGLE else 3)
    unknowns = unknowns_of(scheme, family, count)
    size = len(unknowns)
    gram = [[0.0] * size for _ in range(size)]
    right = {name: [0.0] * size for name in functions}
    directions = lights(order)

    def count_in(row: list[float], targets: dict[str, float], weight: float) -> None:
        for i, value in enumerate(row):
            weighted = weight * value
            if weighted == 0.0:
                continue
            line = gram[i]
            for j in range(i, size):
                line[j] += weighted * row[j]
            for name, target in targets.items():
                right[name][i] += weighted * target

    for view in views:
        mu, sine = math.cos(math.radians(view)), math.sin(math.radians(view))
        powers = (1.0, sine, sine * mu, sine * mu * mu)
        received = dict.fromkeys(functions, 0.0)
        for l, solid_angle in directions:
            values = lobe_values(scheme, lobes, *l, mu)
            targets = {name: function(l, mu) for name, function in functions.items()}
            count_in([values[k] * powers[power] for k, power in unknowns], targets, solid_angle)
            for name, target in targets.items():
                received[name] += solid_angle * target / math.pi
        if scheme == SIGNED:
            # a uniform world gives a lobe in EEVEE its length, whatever part of it is below the surface
            lengths = [math.hypot(lobe.along, lobe.side, lobe.up(mu)) for lobe in lobes]
            count_in([lengths[k] * powers[power] for k, power in unknowns], received, WORLD)
    for i in range(size):
        gram[i][i] *= 1.0 + RIDGE
        for j in range(i):
            gram[i][j] = gram[j][i]
    weights = {}
    for name in functions:
        numbers = [[0.0] * 4 for _ in range(count)]
        for (k, power), value in zip(unknowns, solve(gram, right[name]), strict=True):
            numbers[k][power] = value
        weights[name] = tuple(Weight(*row) for row in numbers)
    return Fit(lobes, weights)


def solve(matrix: list[list[float]], right: list[float]) -> list[float]:
    """Return x of matrix x = right for a symmetric positive definite matrix, by Cholesky's decomposition."""
    size = len(right)
    lower = [[0.0] * size for _ in range(size)]
    for i in range(size):
        for j in range(i + 1):
            rest = matrix[i][j] - sum(lower[i][k] * lower[j][k] for k in range(j))
            lower[i][j] = math.sqrt(rest) if i == j else rest / lower[j][j]
    y: list[float] = []
    for i in range(size):
        y.append((right[i] - sum(lower[i][k] * y[k] for k in range(i))) / lower[i][i])
    x = [0.0] * size
    for i in reversed(range(size)):
        x[i] = (y[i] - sum(lower[k][i] * x[k] for k in range(i + 1, size))) / lower[i][i]
    return x


def transmittance(order: int) -> tuple[float, ...]:
    """Return c of 1 - <1 - F> = f (c_1 + c_2 f + c_3 f^2), f = (n - 1) / (n + 1), for n in [1, 3]."""
    gram, right = [[0.0] * 3 for _ in range(3)], [0.0] * 3
    for step in range(1, order + 1):
        f = 0.5 * step / order
        boundary = Wolff((1.0 + f) / (1.0 - f)).boundary
        passed = sum(w * boundary.transmittance(0.5 + 0.5 * x) * (0.5 + 0.5 * x) for x, w in gauss_legendre(2 * order))
        powers = [f, f * f, f * f * f]
        for i in range(3):
            right[i] += powers[i] * (1.0 - passed)
            for j in range(3):
                gram[i][j] += powers[i] * powers[j]
    return tuple(solve(gram, right))


def fit_all(order: int, views: Sequence[int]) -> dict[str, dict[str, Fit]]:
    """Return the fits by scheme and family."""
    table: dict[str, dict[str, Fit]] = {SINGLE: {}, PAIR: {}, SIGNED: {}, CYCLES: {}}
    for key, family in FAMILIES.items():
        for scheme, fits in table.items():
            if (scheme, key) != (CYCLES, "fujii"):  # Cycles has it
                fits[key] = fit(scheme, key, lobes_of(scheme, family.directions(scheme)), order, views)
    return table


def search(key: str, scheme: str) -> tuple[float, tuple[float, ...]]:
    """Return the least lobe error of a family in PAIR or SIGNED, and the directions that give it, by a compass search.

    It starts from those in use, and steps each number by ever less until a step of STEP_END no longer helps.
    """
    family = FAMILIES[key]

    def error(directions: tuple[float, ...]) -> float:
        table = {scheme: {key: fit(scheme, key, lobes_of(scheme, directions), SEARCH_ORDER, VIEWS)}}
        return lobe_error(Rendered(family.model, scheme, table), family.model)

    best = family.directions(scheme)
    least, step = error(best), STEP
    while step > STEP_END:
        tries = [(*best[:i], best[i] + d, *best[i + 1 :]) for i in range(len(best)) for d in (step, -step)]
        better = next(((e, directions) for directions in tries if (e := error(directions)) < least - ENOUGH), None)
        if better:
            least, best = better
        else:
            step /= 2.0
    return least, best


def source(table: dict[str, dict[str, Fit]], passed: tuple[float, ...]) -> str:
    """Return the table as the text of a Python module."""

    def numbers(values: Sequence[float]) -> str:
        return ", ".join(f"{value:.5g}" if value else "0.0" for value in map(float, values))

    lines = [
        "# SPDX-License-Identifier: GPL-3.0-or-later",
        '"""Written by scripts/fit/lobes.py: the lobes of each scheme and family, and the weight of each lobe by function."""',
        "",
        "from .lobe import Fit, Lobe, Weight",
        "",
        f"TRANSMITTANCE = ({numbers(passed)})",
        "TABLE: dict[str, dict[str, Fit]] = {",
    ]
    for scheme, families in table.items():
        lines.append(f'    "{scheme}": {{')
        for family, (lobes, weights) in families.items():
            lines.append(f'        "{family}": Fit(')
            lines.append("            (" + "".join(f"\n                Lobe({numbers(lobe)})," for lobe in lobes) + "),")
            lines.append("            {")
            for name, row in weights.items():
                lines.append(f'                "{name}": (' + "".join(f"\n                    Weight({numbers(w)})," for w in row))
                lines.append("                ),")
            lines.append("            },")
            lines.append("        ),")
        lines.append("    },")
    lines.append("}")
    return "\n".join(lines) + "\n"


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="fit/lobes.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--search", action="store_true", help="show the best directions of the lobes instead of fitting weights")
    parser.add_argument("--out", type=Path, default=Path("lobe_table.py"), metavar="FILE", help="default: lobe_table.py")
    options = parser.parse_args(script_arguments())
    if options.out.is_dir():
        parser.error(f"{options.out} is a folder")
    return run_script(parser.prog, options.out.parent, partial(write, options))


def write(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Fit and write the table, or search and show what was found."""
    if options.search:
        for key in FAMILIES:
            for scheme in (PAIR, SIGNED):
                least, directions = search(key, scheme)
                terminal.say(f"{key} {scheme}: {100.0 * least:.2f} % with {', '.join(f'{value:.3g}' for value in directions)}")
        return
    output.write_text(options.out.name, source(fit_all(ORDER, VIEWS), transmittance(ORDER)))
    output.publish()
    terminal.say(f"Wrote {options.out}")


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
