# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each home of a model comes to its formula: records for the accuracy report."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Any

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.lobe import CYCLES as CYCLES_LOBES
from true_diffuse.addon.closures.lobe import PAIR, SIGNED, SINGLE
from true_diffuse.addon.closures.lobe_error import lobe_error
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.record import Progress, Record, known
from true_diffuse.addon.models import CyclesDiffuse, Eon, Fujii, Lambert, Model, OrenNayar, OrenNayar1994, Pits, Specular, Wolff
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, Group, chosen_lights
from true_diffuse.scenes.sphere import COLOR, SphereUnderSun, sky, three_lights
from true_diffuse.scripts.studies import osl_values

SIGMAS = (0.2, 0.33, 1.0)
LIGHT_DEGREES = (0.0, 30.0, 60.0, 90.0, 120.0)  # between light and viewer
QUICK_SIGMAS = (0.33,)
QUICK_LIGHT_DEGREES = (0.0, 60.0, 120.0)
OTHER_SIGMAS = (0.33, 1.0)  # for the models beside the paper's own
ENGINES_SAMPLES = 16  # of EEVEE where it is held against Cycles: its area lamps are noisy
OSL_WORK = 20.0  # the measured lobe errors take as long as so many records
SKY = ((0.35, 0.3, 0.25), (0.4, 0.6, 1.0), 0.5)


@dataclass(frozen=True)
class Law:
    """A model as its group's menu, or the group itself, calls it; `make` it with a roughness, or without where it has none."""

    name: str
    make: Callable[[float], Model]
    rough: bool = True
    group: Group = ROUGH_DIFFUSE

    @property
    def stem(self) -> str:
        """Its name in shaders."""
        return self.name.lower().replace("-", "_").replace(" ", "_")

    def material(self, mode: str, **inputs: materials.Setting) -> bpy.types.Material:
        """Return a new material of it in a `mode`, its other sockets set to `inputs`."""
        model = {"Model": self.name} if self.group is ROUGH_DIFFUSE else {}
        return materials.create(f"{self.name} {mode}", self.group, Quality=mode, **model, **inputs)


PAPER = Law("Oren-Nayar", OrenNayar)
LAMBERT = Law("Lambert", lambda _: Lambert(), rough=False)
OTHERS = (
    Law("Fujii", Fujii),
    Law("EON", Eon),
    Law("Cycles Diffuse", CyclesDiffuse),
    Law("Oren-Nayar 1994", OrenNayar1994),
    Law("Wolff", lambda _: Wolff(), rough=False),
    Law("Pitted (Koenderink)", lambda _: Pits(), rough=False),
)
SPECULAR = Law("Standard Specular", lambda _: Specular(), rough=False, group=SPECULAR_GROUP)


@dataclass(frozen=True)
class Way:
    """One way to render a model; `scheme` names the formula of its lobes, from which the lobe error follows; OSL's is measured.

    `in_shadow`: the mode Lamps follows another sun, too, from above, of which there is nothing but shadow.
    """

    home: str
    engine: Engine
    mode: str
    scheme: str | None
    osl: bool = False
    in_shadow: bool = False

    @property
    def name(self) -> str:
        return f"{self.mode}, another in shadow" if self.in_shadow else self.mode


WAYS = (
    Way("nodes", EEVEE, FAST, SINGLE),
    Way("nodes", EEVEE, BALANCED, PAIR),
    Way("nodes", EEVEE, PRECISE, SIGNED),
    Way("nodes", EEVEE, CHOSEN_LIGHTS, None),
    Way("nodes", CYCLES, BALANCED, CYCLES_LOBES),
    Way("nodes", CYCLES, CHOSEN_LIGHTS, None),
    Way("osl", CYCLES, BALANCED, None, osl=True),
)
SPECULAR_WAYS = tuple(Way("nodes", engine, mode, None) for engine in (EEVEE, CYCLES) for mode in (BALANCED, CHOSEN_LIGHTS))
IN_SHADOW = Way("nodes", CYCLES, CHOSEN_LIGHTS, None, in_shadow=True)


@dataclass(frozen=True)
class Case:
    """A model of some roughness, rendered some way; `shown` is what stands in for it where that is another model."""

    way: Way
    law: Law
    sigma: float
    shown: Law | None = None

    @property
    def name(self) -> str:
        mode = f"{self.shown.name} instead" if self.shown else self.way.name
        roughness = f"  {self.sigma:g}" if self.law.rough else ""
        return f"{self.way.engine.label}  {self.way.home}  {mode}  {self.law.name}{roughness}"


def cases(used: Sequence[Engine], quick: bool) -> list[Case]:
    """Return what to measure with the engines `used`: the paper's model first, as Lambert too, then the others, then specular."""
    result = []
    ways = [way for way in WAYS if compiles_osl() or not way.osl]
    for engine in used:
        plain = Way("nodes", engine, BALANCED, None)
        result += [Case(plain, PAPER, sigma, LAMBERT) for sigma in (QUICK_SIGMAS if quick else SIGMAS)]
        for way in ways:
            if way.engine is engine:
                result += [Case(way, PAPER, sigma) for sigma in (QUICK_SIGMAS if quick else SIGMAS)]
        if engine is IN_SHADOW.engine and not quick:
            result += [Case(IN_SHADOW, PAPER, sigma) for sigma in SIGMAS]
        for law in () if quick else OTHERS:
            for way in ways:
                if way.engine is engine:
                    result += [Case(way, law, sigma) for sigma in (OTHER_SIGMAS if law.rough else OTHER_SIGMAS[:1])]
        if not quick:
            result += [Case(way, SPECULAR, 0.0) for way in (*SPECULAR_WAYS, IN_SHADOW) if way.engine is engine]
    return result


def rough(sphere: SphereUnderSun, used: Sequence[Engine], samples: int, quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield a record for each case and angle of the light: the sphere's RMS error and the lobe error, as shares of 1.

    The work is `rough_work` to `progress`. The lobe error is None where the light is what decides.
    """
    other = sphere.sun.copy()  # shines from its own z axis: from above
    other.matrix_world.identity()
    every = cases(used, quick)
    measured = _osl_lobe_errors(every, progress)
    for case in every:
        way, model = case.way, case.law.make(case.sigma)
        chosen_lights.choose([sphere.sun, other] if way.in_shadow else [sphere.sun])
        sphere.scene.cycles.shading_system = way.osl
        rendered = Lambert() if case.shown else Rendered(model, way.scheme) if way.scheme else None
        error_of_lobes = lobe_error(rendered, model) if rendered else measured.get(case)
        shown = case.shown or case.law
        material = shown.material(way.mode, Color=COLOR, **({"Roughness": case.sigma} if shown.rough else {}))
        for angle in _degrees(quick):
            with progress.step(f"{case.name}  {angle:g} degrees", 1.0):
                seconds, (errors,) = sphere.measure(material, (model,), way.engine, samples, angle)
            yield {
                "home": way.home,
                "engine": way.engine.key,
                "mode": "plain Lambert" if case.shown else way.name,
                "model": case.law.name,
                "sigma": case.sigma if case.law.rough else None,
                "light_degrees": angle,
                "samples": samples,
                "rms_error": known(errors.rms),
                "lobe_error": error_of_lobes,
                "render_seconds": seconds,
            }


def rough_work(used: Sequence[Engine], quick: bool) -> float:
    """Return how many units of work `rough` has: one for each record, and OSL's lobe errors."""
    every = cases(used, quick)
    return len(every) * len(_degrees(quick)) + OSL_WORK * any(case.way.osl for case in every)


def _osl_lobe_errors(every: Sequence[Case], progress: Progress) -> dict[Case, float]:
    """Return the lobe errors of those cases that OSL renders."""
    chosen = [case for case in every if case.way.osl]
    if not chosen:
        return {}
    with progress.step("Cycles  osl  lobe errors", OSL_WORK):
        shown = [osl_values.Shown(case.law.stem, case.law.make(case.sigma), case.sigma) for case in chosen]
        return dict(zip(chosen, osl_values.lobe_errors(shown), strict=True))


def between_engines(sphere: SphereUnderSun, progress: Progress) -> Iterator[Record]:
    """Yield a record for each mode of EEVEE and sigma: its RMS difference from Cycles under three lights, a sky, and both.

    Cycles renders the same material without OSL. Each record is one unit of work to `progress`.
    """
    lights, world = three_lights(), sky(*SKY)
    for law, mode, sigma in _pairs():
        material = law.material(mode, Color=COLOR, Roughness=sigma)
        for name, used, background in (("lights", lights, None), ("sky", (), world), ("lights and sky", lights, world)):
            with progress.step(f"EEVEE and Cycles  {name}  {mode}  {law.name}  {sigma:g}", 1.0):
                seconds, difference = sphere.between_engines(material, used, background, ENGINES_SAMPLES)
            yield {
                "mode": mode,
                "model": law.name,
                "sigma": sigma if law.rough else None,
                "light": name,
                "samples": ENGINES_SAMPLES,
                "rms_difference": known(difference),
                "render_seconds": seconds,
            }


def between_engines_work() -> int:
    """Return how many records `between_engines` will give."""
    return 3 * len(_pairs())


def _pairs() -> list[tuple[Law, str, float]]:
    pairs = [(LAMBERT, BALANCED, 0.0)]
    for mode in (FAST, BALANCED, PRECISE):
        pairs += [(PAPER, mode, sigma) for sigma in SIGMAS] + [(OTHERS[2], mode, 0.33)]
    return pairs


def _degrees(quick: bool) -> tuple[float, ...]:
    return QUICK_LIGHT_DEGREES if quick else LIGHT_DEGREES


def rough_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each case, its errors in %, those of all angles side by side."""
    angles = sorted({record["light_degrees"] for record in records})
    columns = ("Way", "Model", "Sigma", "Lobes", *(f"{angle:g}\u00b0" for angle in angles), "s")
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for record in records:
        way = f"{record['engine']} {record['home'] if record['home'] == 'osl' else record['mode']}"
        key = (way, record["model"], record["sigma"])
        groups.setdefault(key, []).append(record)
    rows: list[tuple[str, ...]] = []
    for (way, model, sigma), group in groups.items():
        errors = (_percent(record["rms_error"]) for record in group)
        seconds = f"{median(record['render_seconds'] for record in group):.2f}"
        rows.append((way, model, _sigma(sigma), _percent(group[0]["lobe_error"]), *errors, seconds))
    return columns, rows


def between_engines_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each material, in %."""
    lights = list(dict.fromkeys(record["light"] for record in records))
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for record in records:
        groups.setdefault((record["mode"], record["model"], record["sigma"]), []).append(record)
    rows: list[tuple[str, ...]] = [
        (mode, model, _sigma(sigma), *(_percent(record["rms_difference"]) for record in group))
        for (mode, model, sigma), group in groups.items()
    ]
    return ("Quality", "Model", "Sigma", *lights), rows


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.2f}"


def _sigma(sigma: float | None) -> str:
    return "-" if sigma is None else f"{sigma:g}"
