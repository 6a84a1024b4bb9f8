# SPDX-License-Identifier: GPL-3.0-or-later
"""How near shaders/rough_diffuse.osl, as Cycles renders it, comes to the formulas, and what the worst inputs do.

What is asked of them is in float32_accuracy.py.
"""

import math
import random
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import product

from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.models.registry import Osl
from true_diffuse.addon.models.vector import Vector, add, dot, normalize, scale
from true_diffuse.scripts.studies.float32_accuracy import AccuracyCheck, Reference, anywhere, single, single_vector
from true_diffuse.scripts.studies.osl_values import EXACT, STEEP, VIEWER, Inputs, Sun, drawn, evaluate, suns
from true_diffuse.scripts.studies.study import Step

COUNT, SUNS = 100_000, 12
RENDER_WORK = 8  # as long as so many models take


def stability(exact: Reference, quick: Reference, count: int) -> list[Step]:
    """Return steps that yield a record for each model and family of cases: its worst input, and how many inputs do as asked.

    `exact` gives a formula's value in all digits, `quick` in 64-bit floats. All random inputs are of models that are exact, `count`
    of each, and of those whose error is that of one ramp, as Wolff's; the other families are of all models, of which those that are
    not exact are only asked to be sound. All are rendered at once, in the first step.
    """
    check, families = AccuracyCheck("osl", exact, quick), _cases(count)
    values: list[tuple[float, float, float]] = []
    got = iter(values)

    def render() -> list[Record]:
        values.extend(evaluate([one for family in families.values() for one in family]))
        return []

    def measure(model: str) -> list[Record]:
        parameter = MODELS[model].parameter
        own = {case: family for (of, case), family in families.items() if of == model}
        return check.records(model, [parameter.name] if parameter else [], own, got)

    return [Step("OSL", render, RENDER_WORK), *(Step(f"OSL  {model}", partial(measure, model)) for model in drawn())]


def _between(sun: Sun, mu_i: float, mu_o: float) -> Vector | None:
    """Return the normal with these cosines to the sun and the viewer; None where there is none."""
    l = normalize(sun.towards)
    c, across = dot(l, VIEWER), (l[1], -l[0], 0.0)  # L x V
    rest = 1.0 - c * c
    if rest < 1e-12:
        return None
    a, b = (mu_i - c * mu_o) / rest, (mu_o - c * mu_i) / rest
    left = (1.0 - a * mu_i - b * mu_o) / rest
    if left < -1e-9:
        return None
    return normalize(add(add(scale(l, a), scale(VIEWER, b)), scale(across, math.sqrt(max(0.0, left)))))


def _cases(count: int) -> dict[tuple[str, str], list[Inputs]]:
    """Return the inputs by model and family: random ones, and those that are hard or wrong."""
    dice = random.Random(1)
    somewhere = suns([anywhere(dice) for _ in range(SUNS)])
    ahead, aside, behind, *usual = suns(
        [VIEWER, (1.0, 0.0, 0.0), (0.01, 0.0, -1.0), (0.6, 0.0, 0.8), (0.96, 0.0, -0.28)],
    )

    lit = []
    while len(lit) < count:
        sun, n = somewhere[len(lit) * SUNS // count], single_vector(anywhere(dice))
        if dot(n, sun.towards) > 0.0 and n[2] > 0.0:
            lit.append((sun, n))

    cosines = (0.0, 1e-8, 1e-4, 0.5, 0.8, 1.0 - 1e-8, 1.0)
    grazing = []
    for sun, mu_i, mu_o in product((aside, behind, *usual, *somewhere), cosines, cosines):
        n = _between(sun, mu_i, mu_o)
        if n is not None:
            grazing.append((sun, single_vector(n)))
    below = [
        (sun, single_vector(n)) for sun in (aside, *usual) for mu in (-0.5, -1e-8) if (n := _between(sun, mu, 0.5)) is not None
    ]
    # light and viewer at the normal, light at the viewer, light and viewer at either side of the normal
    aligned = [(ahead, VIEWER), *((ahead, single_vector(normalize((x, 0.3 * x, 1.0)))) for x in (1e-7, 1e-3, 0.5, 2.0, 1e3, 1e7))]
    aligned += [(sun, single_vector(normalize(add(normalize(sun.towards), VIEWER)))) for sun in (aside, *usual, *somewhere)]
    aligned += [(sun, n) for sun in usual for n in (VIEWER, sun.towards) if dot(n, sun.towards) > 0.0 and n[2] > 0.0]

    strange = single(0.0, 1e-40, 1e-8, 1e-6, 1e-5, 1e-3, 1.0, math.pi / 2, 1e3, math.inf, -1.0, -math.inf, math.nan)
    albedos = single(0.0, 1e-40, 1e-3, 1.0, 1.5, 1e3, math.inf, -1.0, -math.inf, math.nan)
    faces = [(usual[0], single_vector(normalize(n))) for n in ((0.3, 0.2, 1.0), (0.5, 0.1, 0.1), (0.0, 0.5, 0.6), (0.8, -0.3, 0.6))]
    wrong = [(0.0, 0.0, 0.0), (math.nan,) * 3, (math.inf, 0.0, 0.0), (math.nan, 0.0, 1.0), (0.0, 0.0, -math.inf)]
    lengths = single(1e-6, 1e-3, 0.5, 2.0, 1e3, 1e6)

    rho, roughness, ior = single(0.7, 0.33, 1.5)
    families: dict[tuple[str, str], list[Inputs]] = {}
    for model in drawn():
        is_towards_viewer = MODELS[model].osl is Osl.EXACT_TOWARDS_VIEWER
        # Oren-Nayar's ramps are other ones where N is not the mesh's
        typical = Inputs(model, ahead, VIEWER, rho, roughness, ior, turns=not is_towards_viewer)

        def at(
            places: Sequence[tuple[Sun, Vector]], typical: Inputs = typical, towards_viewer: bool = is_towards_viewer
        ) -> list[Inputs]:
            chosen = [place for place in places if _towards_viewer(*place)] if towards_viewer else places
            return [replace(typical, sun=sun, normal=n) for sun, n in chosen]

        if MODELS[model].osl in EXACT or not MODELS[model].functions:
            families[model, "random"] = [
                replace(one, albedo=a, roughness=r, ior=n)
                for one in at(lit)
                for a, r, n in [single(dice.random(), dice.random(), dice.uniform(1.0, 3.0))]
            ]
        families[model, "grazing"] = at(grazing)
        families[model, "light below"] = at(below)
        families[model, "aligned"] = at(aligned)
        families[model, "albedo"] = [replace(one, albedo=x) for one in at(faces) for x in albedos]
        families[model, "shape"] = [replace(one, roughness=x, ior=x) for one in at(faces) for x in strange]
        families[model, "normal"] = [
            replace(one, normal=single_vector(scale(one.normal, x)), n=one.normal) for one in at(faces) for x in lengths
        ]
        families[model, "no normal"] = [replace(typical, sun=usual[0], normal=n, n=VIEWER) for n in wrong]
    return families


def _towards_viewer(sun: Sun, n: Vector) -> bool:
    """Return whether s is so far above 0 that the ramps of Oren-Nayar are 0, where the mesh can be turned as N is."""
    n, l = normalize(n), normalize(sun.towards)
    side = add(VIEWER, scale(n, -dot(n, VIEWER)))
    return n[2] > STEEP and dot(side, l) >= 0.01 * math.hypot(*side) * dot(n, l)
