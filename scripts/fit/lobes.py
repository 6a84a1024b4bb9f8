# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the lobes of addon/closures/lobe_table.json to the models, by linear least squares over all lights and views.

uv run scripts/fit/lobes.py --out addon/closures/lobe_table.json               seconds
uv run scripts/fit/lobes.py --out addon/closures/lobe_table.json --search      minutes: with better directions than the table's
"""

import math
import sys
from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from itertools import product
from pathlib import Path
from typing import NamedTuple

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes the checkout the package true_diffuse
from true_diffuse.addon.closures.lobe import CYCLES, PAIR, SIGNED, SINGLE, Fit, Lobe, Weight, lobe_values, mapped_share
from true_diffuse.addon.closures.lobe_error import lobe_error
from true_diffuse.addon.closures.lobe_table import TABLE, to_json
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.models import MODELS, Model, ReflectanceModel
from true_diffuse.addon.models.oren_nayar import RAMP
from true_diffuse.addon.models.quadrature import gauss_legendre
from true_diffuse.addon.models.registry import CyclesClosures
from true_diffuse.addon.models.vector import Vector, dot, from_polar
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import run_script
from true_diffuse.scripts.fit.least_squares import least_squares

VIEWS = tuple(range(5, 90, 5))  # degrees from N
SEARCH_ORDER = 12  # the same, for `search`
STEP, STEP_END, ENOUGH = 0.12, 0.01, 1e-6  # its steps, and what counts as better
ORDER = 24  # lights: this many elevations, and azimuths in half a circle, for each view
ASIDE: Vector = (0.6, 0.0, 0.8)  # a light
# Of the search, for functions that are new: Fujii's half, and others
START = {PAIR: ((0.0, 1.0), (0.0, 1.0)), SIGNED: ((0.93, 0.55), (0.93, 0.5, 1.1, 0.6))}
WORLD = 1000.0  # how much a uniform world counts against lamps where it is fitted beside them
GRAZING_VIEW = 87  # degrees, one more of a uniform world, which shows most there
MAPPED_VIEWS, TILTS, TILT_AZIMUTHS = (15, 35, 55, 75), (5, 15, 30, 45), (0, 45, 90, 135, 180)  # degrees
MAPPED_ORDER, LOWEST = 8, 0.1
RIDGE = 1e-9  # keeps weights small that the light hardly tells apart

type Directions = dict[tuple[str, str], tuple[float, ...]]  # by family and lobe set

FACING = Lobe(0.0, 0.0, 1.0, 0.0, 0.0)


def signed_lobes(*directions: float) -> tuple[Lobe, ...]:
    """Return the creases, each split sideways: one at x = `steep` z / mu and, with four numbers, one at x = -`up` z.

    Fujii's `up` in the table is steeper than the search finds, 1.15 instead of 1: lights far behind the surface are twice as near
    to the model then, for 0.03 % of lobe error at a roughness of 0.33.
    """
    steep, side, *other = directions
    crease = Lobe(1.0, side, 0.0, 0.0, -steep)
    return (crease, Lobe(-1.0, other[1], -other[0], 0.0, 0.0)) if other else (crease,)


def pair_lobes(up_0: float, up_1: float) -> tuple[Lobe, ...]:
    """Return a lobe around N and one bent towards the viewer, along V_t + (up_0 + up_1 mu) N."""
    return FACING, Lobe(1.0, 0.0, up_0, up_1, 0.0)


def lobes_of(lobe_set: str, directions: tuple[float, ...]) -> tuple[Lobe, ...]:
    """Return the lobes of a set, made of a family's numbers."""
    return pair_lobes(*directions) if lobe_set == PAIR else signed_lobes(*directions) if lobe_set == SIGNED else ()


class Family(NamedTuple):
    """The functions of a `model`, fitted together, and its formula at its roughest."""

    model: ReflectanceModel
    formula: Model

    @property
    def vanishes(self) -> bool:
        """Whether all functions are 0 where V = N, and so all lobes."""
        return all(abs(function.value(ASIDE, 1.0)) < 1e-12 for function in self.model.functions)

    @property
    def is_half_of_fujii(self) -> bool:
        """Whether the function is Fujii's without its negative part: in Cycles a lobe away from the viewer takes that away."""
        return self.vanishes and not any(function.is_signed for function in self.model.functions)

    def directions(self, lobe_set: str) -> tuple[float, ...]:
        """Return the numbers that the lobes of a set are made of, as `search` has found them; START where it has not yet.

        The lobes of SINGLE and CYCLES are the engines' own.
        """
        if lobe_set not in START:
            return ()
        known = TABLE[lobe_set].get(self.model.functions[0].name)
        if known is None:
            return START[lobe_set][not self.is_half_of_fujii]
        if lobe_set == PAIR:
            return known.lobes[1].up_0, known.lobes[1].up_1
        crease, *other = known.lobes
        return -crease.steep, crease.side, *(number for lobe in other for number in (-lobe.up_0, lobe.side))


def families() -> dict[str, Family]:
    """Return the families by the names of their first functions, each with the first model that is made of all of them."""
    found: dict[str, Family] = {}
    for model in MODELS.values():
        known = found.get(model.functions[0].name) if model.functions else None
        if model.functions and (known is None or len(known.model.functions) < len(model.functions)):
            found[model.functions[0].name] = Family(model, model.formula(*([1.0] if model.parameter else [])))
    return found


def lights(order: int) -> list[tuple[Vector, float]]:
    """Return directions L above the surface, y > 0, with the solid angle of each (both halves together)."""
    result = []
    for node, weight in gauss_legendre(order):
        z = 0.5 + 0.5 * node
        for k in range(order):
            result.append((from_polar(z, math.pi * (k + 0.5) / order), math.pi * weight / order))
    return result


def unknowns_of(lobe_set: str, family: Family, lobes: int) -> list[tuple[int, int]]:
    """Return the unknowns of a fit: (lobe, which number of its weight).

    Cycles has no negative weights: the lobe away from the viewer serves only what is half of Fujii's function.
    """
    if lobe_set == CYCLES:
        return [(1, 0), (2, 1)] if family.is_half_of_fujii else [(k, power) for k in (0, 1) for power in range(4)]
    first = 1 if lobe_set == SIGNED and family.is_half_of_fujii else 0
    return [(k, power) for k in range(first, lobes) for power in range(4) if power > 0 or (k == 0 and not family.vanishes)]


def fit(lobe_set: str, family: Family, lobes: tuple[Lobe, ...], order: int, views: Sequence[int]) -> Fit:
    """Return the least-squares weights of a family's functions; `order` and `views` [degrees from N] set how finely."""
    functions = {function.name: function.value for function in family.model.functions}
    count = len(lobes) + 1 if lobe_set == SIGNED else len(lobes) or (2 if lobe_set == SINGLE else 3)
    unknowns = unknowns_of(lobe_set, family, count)
    directions = lights(order)
    rows: list[list[float]] = []
    counted: list[float] = []  # how much each row counts
    wanted: dict[str, list[float]] = {name: [] for name in functions}
    for view in views:
        mu = math.cos(math.radians(view))
        powers = powers_of(mu)
        for l, solid_angle in directions:
            values = lobe_values(lobe_set, lobes, l, mu)
            rows.append([values[k] * powers[power] for k, power in unknowns])
            counted.append(solid_angle)
            for name, function in functions.items():
                wanted[name].append(function(l, mu))
    if lobe_set == SIGNED and not family.vanishes:  # seen along N a uniform world, too, has the lobe around N alone
        rows.append([float(power == 0) for _, power in unknowns])
        counted.append(WORLD)
        for name, function in functions.items():
            wanted[name].append(sum(solid_angle * function(l, 1.0) for l, solid_angle in directions) / math.pi)
    weights = {}
    for name in functions:
        numbers = [[0.0] * 4 for _ in range(count)]
        for (k, power), value in zip(unknowns, least_squares(rows, wanted[name], counted, RIDGE), strict=True):
            numbers[k][power] = value
        weights[name] = tuple(Weight(*row) for row in numbers)
        if lobe_set == SIGNED:
            weights[name] = with_world(functions[name], lobes, weights[name], directions, (*views, GRAZING_VIEW))
    return Fit(lobes, weights)


def powers_of(mu: float) -> tuple[float, ...]:
    """Return what the numbers of a weight are the factors of."""
    sine = math.sqrt(1.0 - mu * mu)
    return 1.0, sine, sine * mu, sine * mu * mu


def with_world(
    function: Callable[[Vector, float], float],
    creases: tuple[Lobe, ...],
    weights: tuple[Weight, ...],
    directions: list[tuple[Vector, float]],
    views: Sequence[int],
) -> tuple[Weight, ...]:
    """Return the weights of the signed lobes with those of the lobes under the surface, which no lamp above it reaches.

    With them a uniform world is reflected as it should be, on either side of N.
    """
    around, *sides = weights
    result = [around]
    for crease, weight in zip(creases, sides, strict=True):
        rows, wanted = [], []
        for view in views:
            mu = math.cos(math.radians(view))
            lit = [(l, solid_angle) for l, solid_angle in directions if crease.along * l[0] > 0.0]
            received = crease.along / math.pi * sum(a * (function(l, mu) - around.at(mu) * l[2]) for l, a in lit)
            length = crease.under.length(mu)
            rows.append([power * length for power in powers_of(mu)])
            wanted.append(received - weight.at(mu) * (1.0 - crease.length(mu)))
        result += [weight, Weight(*least_squares(rows, wanted, None, RIDGE))]
    return tuple(result)


def fit_all(order: int, views: Sequence[int], better: Directions | None = None) -> dict[str, dict[str, Fit]]:
    """Return the fits by lobe set and family; with `better` directions in place of those in the table."""
    table: dict[str, dict[str, Fit]] = {SINGLE: {}, PAIR: {}, SIGNED: {}, CYCLES: {}}
    for key, family in families().items():
        for lobe_set, fits in table.items():
            if lobe_set != CYCLES or family.model.cycles is CyclesClosures.LOBES:
                directions = (better or {}).get((key, lobe_set)) or family.directions(lobe_set)
                fits[key] = fit(lobe_set, family, lobes_of(lobe_set, directions), order, views)
    return table


def mapped_views(lowest: float) -> list[tuple[float, Vector, list[Vector]]]:
    """Return surfaces whose N is mapped: mu, the mesh's normal and lights in the frame (V_t, N x V_t, N).

    The lights are above both horizons by a cosine of `lowest`.
    """
    result = []
    for view, tilt, azimuth in product(MAPPED_VIEWS, TILTS, TILT_AZIMUTHS):
        mu, mesh = math.cos(math.radians(view)), from_polar(math.cos(math.radians(tilt)), math.radians(azimuth))
        if math.sqrt(1.0 - mu * mu) * mesh[0] + mu * mesh[2] > LOWEST:
            both = ((x, side * y, z) for (x, y, z), _ in lights(MAPPED_ORDER) for side in (1.0, -1.0))
            result.append((mu, mesh, [l for l in both if min(l[2], dot(mesh, l)) > lowest]))
    return result


def fit_mapped() -> tuple[float, float]:
    """Return MAPPED_BASE and MAPPED_FUJII, with which the error is least in relation to Lambert's radiance."""
    fit = TABLE[CYCLES][RAMP.name].weights[RAMP.name]
    rows, wanted = [], []
    for mu, mesh, seen in mapped_views(LOWEST):
        weights = [weight.at(mu) for weight in fit]
        rest = 1.0 - mapped_share(mesh[2])
        for l in seen:
            lambert, fujii, away = lobe_values(CYCLES, (), l, mu, mesh)  # all relative to Lambert's law
            rows.append([rest * weights[2], -rest * mu * weights[1] * fujii / lambert])
            wanted.append(RAMP.value(l, mu) / l[2] - (weights[1] * fujii + (1.0 - rest) * weights[2] * away) / lambert)
    base, fujii = least_squares(rows, wanted)
    return base, fujii


def search(key: str, lobe_set: str) -> tuple[float, tuple[float, ...]]:
    """Return the least lobe error of a family in PAIR or SIGNED, and the directions that give it, by a compass search.

    It starts from those in use, and steps each number by ever less until a step of STEP_END no longer helps.
    """
    family = families()[key]

    def error(directions: tuple[float, ...]) -> float:
        table = {lobe_set: {key: fit(lobe_set, family, lobes_of(lobe_set, directions), SEARCH_ORDER, VIEWS)}}
        return lobe_error(Rendered(family.formula, lobe_set, table), family.formula)

    best = family.directions(lobe_set)
    least, step = error(best), STEP
    while step > STEP_END:
        tries = [(*best[:i], best[i] + d, *best[i + 1 :]) for i in range(len(best)) for d in (step, -step)]
        better = next(((e, directions) for directions in tries if (e := error(directions)) < least - ENOUGH), None)
        if better:
            least, best = better
        else:
            step /= 2.0
    return least, best


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="fit/lobes.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "--search", action="store_true", help="search for better directions of the lobes, as functions that are new need"
    )
    parser.add_argument("--out", type=Path, default=Path("lobe_table.json"), metavar="FILE", help="default: lobe_table.json")
    options = parser.parse_args(script_arguments())
    if options.out.is_dir():
        parser.error(f"{options.out} is a folder")
    return run_script(parser.prog, options.out.parent, partial(write, options), name=options.out.name)


def write(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Fit and write the table, with directions that are searched for if asked."""
    better: Directions = {}
    if options.search:
        for key in families():
            for lobe_set in START:
                least, directions = search(key, lobe_set)
                better[key, lobe_set] = directions = tuple(float(f"{value:.3g}") for value in directions)
                numbers = ", ".join(f"{value:g}" for value in directions)
                terminal.say(f"{key} {lobe_set}: {100.0 * least:.2f} % with {numbers}")
    output.write_json(options.out.name, to_json(fit_all(ORDER, VIEWS, better)))
    output.publish()
    terminal.say(
        f"Wrote {options.out}; in lobe.py belong MAPPED_BASE, MAPPED_FUJII = {', '.join(f'{x:.4g}' for x in fit_mapped())}"
    )


if __name__ == "__main__":
    end(main())
