# SPDX-License-Identifier: GPL-3.0-or-later
"""What the node groups reflect of a uniform world: the white furnace."""

from collections.abc import Iterator, Sequence
from functools import cache, partial
from itertools import product
from statistics import fmean

from true_diffuse.addon.blender.engines import EEVEE, Engine
from true_diffuse.addon.closures.quality import CHOSEN_LIGHTS
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models import directional_albedo
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scripts.studies.rough import EVERY, QUICK_MODELS, Configuration, MeasuredModel, configurations
from true_diffuse.scripts.studies.sheet import USUAL, fed, sheet
from true_diffuse.scripts.studies.study import Step, Table, pivot, text

MUS = (1.0, 0.5, 0.2, 0.05)
SIGMAS = (0.0, 0.2, 0.33, 1.0)
ALBEDOS = (1.0, 0.8)
CELL = 8  # pixels across
SAMPLES = {"eevee": 16, "cycles": 1024}  # Cycles' noise of a cell's mean is then some 0.1 %


def furnace(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield what each model, target and quality reflects of a uniform world's light, and what the formula says.

    EEVEE renders without ray tracing, and once more with it.
    """
    rows = list(product(SIGMAS, ALBEDOS))
    bent = sheet(MUS, [{**USUAL, "Roughness": (sigma,) * 3, "Color": (rho,) * 3} for sigma, rho in rows], CELL)
    white = uniform_world()

    def measure(configuration: Configuration, measured: MeasuredModel, traced: bool) -> Iterator[Record]:
        samples = SAMPLES[configuration.engine.key]
        bent.scene.cycles.shading_system = configuration.osl
        cells = bent.cells(fed(measured, configuration.quality), configuration.engine, samples, white, traced)
        for ((sigma, rho), mu), values in zip(product(rows, MUS), cells, strict=True):
            if measured.is_rough or sigma == SIGMAS[0]:
                yield {
                    **configuration.record,
                    "model": measured.name,
                    "sigma": sigma if measured.is_rough else None,
                    "albedo": rho,
                    "mu": mu,
                    "ray_tracing": traced,
                    "rendered": fmean(values),
                    "analytic": _albedo(measured, sigma, mu, rho),
                    "samples": samples,
                }

    models = QUICK_MODELS if quick else tuple(EVERY.values())
    plain = [(one, each, False) for one, each in configurations(used, models) if one.quality != CHOSEN_LIGHTS]
    traced = [(one, each, True) for one, each, _ in plain if one.engine is EEVEE and each in QUICK_MODELS]
    return [
        Step(f"Furnace  {case[0].name}  {case[1].name}{'  ray tracing' * case[2]}", partial(measure, *case))
        for case in plain + traced
    ]


@cache
def _albedo(measured: MeasuredModel, sigma: float, mu: float, rho: float) -> float:
    return directional_albedo(measured.formula(sigma), mu, rho, order=16)  # to 1e-5 also for Pitted, the least smooth


def table(records: Sequence[Record]) -> Table:
    """Return rendered and, in brackets, analytic albedo by N.V, for rho = 1."""

    def row(one: Record) -> tuple[str, ...]:
        quality = f"{one['target']}, {one['quality']}{', ray tracing' * one['ray_tracing']}"
        return one["engine"], quality, one["model"], text(one["sigma"])

    white = [one for one in records if one["albedo"] == 1.0]
    titles = ("Engine", "Target and quality", "Model", "Sigma")
    return pivot(
        white,
        titles,
        row,
        lambda one: f"N.V {one['mu']:g}",
        lambda found: f"{found[0]['rendered']:.3f} ({found[0]['analytic']:.3f})",
    )
