# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each home of a model comes to its formula: records for the accuracy report."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median

import bpy

from ..scenes.sphere import COLOR, SphereUnderSun
from . import materials
from .comparison import Progress, Record, known
from .engines import CYCLES, EEVEE, Engine
from .measure.lobe_error import lobe_error
from .models import Lambert, Model, OrenNayar
from .models.lobes import CyclesLobes, EeveeLobes
from .nodes import LAMBERT, OREN_NAYAR

SIGMAS = (0.2, 0.33, 1.0)
LIGHT_DEGREES = (0.0, 30.0, 60.0, 90.0, 120.0)  # between light and viewer
QUICK_LIGHT_DEGREES = (0.0, 60.0, 120.0)


@dataclass(frozen=True)
class Way:
    """One way to render equation (1): `lobes` is the formula of what it renders, from which the lobe error follows."""

    home: str
    engine: Engine
    mode: str
    osl: bool
    material: Callable[[float], bpy.types.Material]
    lobes: Callable[[float], Model]


def _lambert(_sigma: float) -> bpy.types.Material:
    return materials.create("Lambert", LAMBERT, Color=COLOR)


def _group(sigma: float) -> bpy.types.Material:
    return materials.create("Oren-Nayar", OREN_NAYAR, Color=COLOR, Sigma=sigma)


def _osl(sigma: float) -> bpy.types.Material:
    return materials.create_osl("Oren-Nayar OSL", "oren_nayar", Color=COLOR, Sigma=sigma)


WAYS = (
    Way("nodes", EEVEE, "plain Lambert", False, _lambert, lambda _sigma: Lambert()),
    Way("nodes", EEVEE, "lobes", False, _group, EeveeLobes),
    Way("nodes", CYCLES, "plain Lambert", False, _lambert, lambda _sigma: Lambert()),
    Way("nodes", CYCLES, "lobes", False, _group, CyclesLobes),
    Way("osl", CYCLES, "lobes", True, _osl, CyclesLobes),
)


def rough(
    sphere: SphereUnderSun, used: Sequence[Engine], degrees: Sequence[float], samples: int, progress: Progress
) -> Iterator[Record]:
    """Yield a record for each way, sigma and angle of the light: the sphere's RMS error and the lobe error, as shares of 1.

    Each is one unit of work to `progress`.
    """
    for way in _ways(used):
        sphere.scene.cycles.shading_system = way.osl
        for sigma in SIGMAS:
            error_of_lobes = lobe_error(way.lobes(sigma), OrenNayar(sigma))
            material = way.material(sigma)
            for angle in degrees:
                with progress.step(f"{way.engine.label}  {way.home}  {way.mode}  sigma {sigma:g}  {angle:g} degrees", 1.0):
                    seconds, (errors,) = sphere.measure(material, (OrenNayar(sigma),), way.engine, samples, angle)
                yield {
                    "home": way.home,
                    "engine": way.engine.key,
                    "mode": way.mode,
                    "model": OrenNayar.__name__,
                    "sigma": sigma,
                    "light_degrees": angle,
                    "samples": samples,
                    "rms_error": known(errors.rms),
                    "lobe_error": error_of_lobes,
                    "render_seconds": seconds,
                }


def work(used: Sequence[Engine], degrees: Sequence[float]) -> int:
    """Return how many records `rough` will give."""
    return len(_ways(used)) * len(SIGMAS) * len(degrees)


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each way and sigma, the errors of all angles side by side."""
    angles = sorted({record["light_degrees"] for record in records})
    columns = ("Engine", "Home and mode", "Sigma", "Lobe error", *(f"{angle:g}\u00b0" for angle in angles), "Seconds")
    groups: dict[tuple[str, str, float], list[Record]] = {}
    for record in records:
        groups.setdefault((record["engine"], f"{record['home']}, {record['mode']}", record["sigma"]), []).append(record)
    rows = []
    for (engine, way, sigma), group in groups.items():
        errors = ("-" if record["rms_error"] is None else f"{100.0 * record['rms_error']:.2f} %" for record in group)
        seconds = median(record["render_seconds"] for record in group)
        rows.append((engine, way, f"{sigma:g}", f"{100.0 * group[0]['lobe_error']:.2f} %", *errors, f"{seconds:.2f}"))
    return columns, rows


def _ways(used: Sequence[Engine]) -> list[Way]:
    return [way for way in WAYS if way.engine in used]
