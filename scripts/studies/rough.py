# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each target of a model comes to its formula: records for the accuracy report."""

from collections.abc import Iterator, Sequence
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
from true_diffuse.addon.models import MODELS, Lambert, Model, ReflectanceModel, Specular
from true_diffuse.addon.models.registry import IOR
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
class MeasuredModel:
    """A reflectance model in the group Rough Diffuse; without one the group Standard Specular."""

    model: ReflectanceModel | None

    @property
    def name(self) -> str:
        return self.model.label if self.model else SPECULAR_GROUP.label

    @property
    def group(self) -> Group:
        return ROUGH_DIFFUSE if self.model else SPECULAR_GROUP

    @property
    def is_rough(self) -> bool:
        return self.model is not None and self.model.is_rough

    def formula(self, roughness: float) -> Model:
        """Return its formula, of that roughness if it has one; else of the group's usual inputs."""
        return self.model.reference({"Roughness": roughness, "IOR": IOR.usual}) if self.model else Specular()

    def material(self, quality: str, **inputs: materials.Setting) -> bpy.types.Material:
        """Return a new material of it in a `quality`, its other sockets set to `inputs`."""
        model = {"Model": self.model.label} if self.model else {}
        return materials.create(f"{self.name} {quality}", self.group, Quality=quality, **model, **inputs)


EVERY = {model.id: MeasuredModel(model) for model in MODELS.values()}
PAPER, LAMBERT, EON = EVERY["oren_nayar"], EVERY["lambert"], EVERY["eon"]
OTHERS = tuple(measured for measured in EVERY.values() if measured not in (PAPER, LAMBERT))
SPECULAR = MeasuredModel(None)


@dataclass(frozen=True)
class Configuration:
    """How to render a model; `lobe_set` names its lobes, from which the lobe error follows; OSL's is measured.

    `in_shadow`: the quality for chosen lights follows another sun, too, from above, whose light is all in shadow.
    """

    target: str
    engine: Engine
    quality: str
    lobe_set: str | None
    osl: bool = False
    in_shadow: bool = False

    @property
    def name(self) -> str:
        return f"{self.quality}, another in shadow" if self.in_shadow else self.quality


CONFIGURATIONS = (
    Configuration("nodes", EEVEE, FAST, SINGLE),
    Configuration("nodes", EEVEE, BALANCED, PAIR),
    Configuration("nodes", EEVEE, PRECISE, SIGNED),
    Configuration("nodes", EEVEE, CHOSEN_LIGHTS, None),
    Configuration("nodes", CYCLES, BALANCED, CYCLES_LOBES),
    Configuration("nodes", CYCLES, CHOSEN_LIGHTS, None),
    Configuration("osl", CYCLES, BALANCED, None, osl=True),
)
SPECULAR_CONFIGURATIONS = tuple(
    Configuration("nodes", engine, quality, None) for engine in (EEVEE, CYCLES) for quality in (BALANCED, CHOSEN_LIGHTS)
)
IN_SHADOW = Configuration("nodes", CYCLES, CHOSEN_LIGHTS, None, in_shadow=True)


@dataclass(frozen=True)
class Case:
    """A model of some roughness, rendered some way; `shown` is what stands in for it where that is another model."""

    configuration: Configuration
    measured: MeasuredModel
    sigma: float
    shown: MeasuredModel | None = None

    @property
    def name(self) -> str:
        quality = f"{self.shown.name} instead" if self.shown else self.configuration.name
        roughness = f"  {self.sigma:g}" if self.measured.is_rough else ""
        return f"{self.configuration.engine.label}  {self.configuration.target}  {quality}  {self.measured.name}{roughness}"


def cases(used: Sequence[Engine], quick: bool) -> list[Case]:
    """Return what to measure with the engines `used`: the paper's model first, as Lambert too, then the others, then specular."""
    result = []
    configurations = [configuration for configuration in CONFIGURATIONS if compiles_osl() or not configuration.osl]
    for engine in used:
        plain = Configuration("nodes", engine, BALANCED, None)
        result += [Case(plain, PAPER, sigma, LAMBERT) for sigma in (QUICK_SIGMAS if quick else SIGMAS)]
        for configuration in configurations:
            if configuration.engine is engine:
                result += [Case(configuration, PAPER, sigma) for sigma in (QUICK_SIGMAS if quick else SIGMAS)]
        if engine is IN_SHADOW.engine and not quick:
            result += [Case(IN_SHADOW, PAPER, sigma) for sigma in SIGMAS]
        for measured in () if quick else OTHERS:
            sigmas = OTHER_SIGMAS if measured.is_rough else OTHER_SIGMAS[:1]
            for configuration in configurations:
                if configuration.engine is engine and not (configuration.osl and measured.model and measured.model.osl is None):
                    result += [Case(configuration, measured, sigma) for sigma in sigmas]
        if not quick:
            result += [
                Case(configuration, SPECULAR, 0.0)
                for configuration in (*SPECULAR_CONFIGURATIONS, IN_SHADOW)
                if configuration.engine is engine
            ]
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
        configuration, model = case.configuration, case.measured.formula(case.sigma)
        chosen_lights.choose([sphere.sun, other] if configuration.in_shadow else [sphere.sun])
        sphere.scene.cycles.shading_system = configuration.osl
        rendered = Lambert() if case.shown else Rendered(model, configuration.lobe_set) if configuration.lobe_set else None
        error_of_lobes = lobe_error(rendered, model) if rendered else measured.get(case)
        shown = case.shown or case.measured
        material = shown.material(configuration.quality, Color=COLOR, **({"Roughness": case.sigma} if shown.is_rough else {}))
        for angle in _degrees(quick):
            with progress.step(f"{case.name}  {angle:g} degrees", 1.0):
                seconds, (errors,) = sphere.measure(material, (model,), configuration.engine, samples, angle)
            yield {
                "target": configuration.target,
                "engine": configuration.engine.key,
                "quality": "plain Lambert" if case.shown else configuration.name,
                "model": case.measured.name,
                "sigma": case.sigma if case.measured.is_rough else None,
                "light_degrees": angle,
                "samples": samples,
                "rms_error": known(errors.rms),
                "lobe_error": error_of_lobes,
                "render_seconds": seconds,
            }


def rough_work(used: Sequence[Engine], quick: bool) -> float:
    """Return how many units of work `rough` has: one for each record, and OSL's lobe errors."""
    every = cases(used, quick)
    return len(every) * len(_degrees(quick)) + OSL_WORK * any(case.configuration.osl for case in every)


def _osl_lobe_errors(every: Sequence[Case], progress: Progress) -> dict[Case, float]:
    """Return the lobe errors of those cases that OSL renders."""
    chosen = {case: case.measured.model.id for case in every if case.configuration.osl and case.measured.model}
    if not chosen:
        return {}
    with progress.step("Cycles  osl  lobe errors", OSL_WORK):
        shown = [osl_values.Shown(model, case.measured.formula(case.sigma), case.sigma) for case, model in chosen.items()]
        return dict(zip(chosen, osl_values.lobe_errors(shown), strict=True))


def between_engines(sphere: SphereUnderSun, progress: Progress) -> Iterator[Record]:
    """Yield a record for each quality of EEVEE and sigma: its RMS difference from Cycles under three lights, a sky, and both.

    Cycles renders the same material without OSL. Each record is one unit of work to `progress`.
    """
    lights, world = three_lights(), sky(*SKY)
    for measured, quality, sigma in _pairs():
        material = measured.material(quality, Color=COLOR, Roughness=sigma)
        for name, used, background in (("lights", lights, None), ("sky", (), world), ("lights and sky", lights, world)):
            with progress.step(f"EEVEE and Cycles  {name}  {quality}  {measured.name}  {sigma:g}", 1.0):
                seconds, difference = sphere.between_engines(material, used, background, ENGINES_SAMPLES)
            yield {
                "quality": quality,
                "model": measured.name,
                "sigma": sigma if measured.is_rough else None,
                "light": name,
                "samples": ENGINES_SAMPLES,
                "rms_difference": known(difference),
                "render_seconds": seconds,
            }


def between_engines_work() -> int:
    """Return how many records `between_engines` will give."""
    return 3 * len(_pairs())


def _pairs() -> list[tuple[MeasuredModel, str, float]]:
    pairs = [(LAMBERT, BALANCED, 0.0)]
    for quality in (FAST, BALANCED, PRECISE):
        pairs += [(PAPER, quality, sigma) for sigma in SIGMAS] + [(EVERY["cycles_diffuse"], quality, 0.33)]
    return pairs


def _degrees(quick: bool) -> tuple[float, ...]:
    return QUICK_LIGHT_DEGREES if quick else LIGHT_DEGREES


def rough_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each case, its errors in %, those of all angles side by side."""
    angles = sorted({record["light_degrees"] for record in records})
    columns = ("Configuration", "Model", "Sigma", "Lobes", *(f"{angle:g}\u00b0" for angle in angles), "s")
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for record in records:
        configuration = f"{record['engine']} {record['target'] if record['target'] == 'osl' else record['quality']}"
        key = (configuration, record["model"], record["sigma"])
        groups.setdefault(key, []).append(record)
    rows: list[tuple[str, ...]] = []
    for (configuration, model, sigma), group in groups.items():
        errors = (_percent(record["rms_error"]) for record in group)
        seconds = f"{median(record['render_seconds'] for record in group):.2f}"
        rows.append((configuration, model, _sigma(sigma), _percent(group[0]["lobe_error"]), *errors, seconds))
    return columns, rows


def between_engines_table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: a row for each material, in %."""
    lights = list(dict.fromkeys(record["light"] for record in records))
    groups: dict[tuple[Any, ...], list[Record]] = {}
    for record in records:
        groups.setdefault((record["quality"], record["model"], record["sigma"]), []).append(record)
    rows: list[tuple[str, ...]] = [
        (quality, model, _sigma(sigma), *(_percent(record["rms_difference"]) for record in group))
        for (quality, model, sigma), group in groups.items()
    ]
    return ("Quality", "Model", "Sigma", *lights), rows


def _percent(share: float | None) -> str:
    return "-" if share is None else f"{100.0 * share:.2f}"


def _sigma(sigma: float | None) -> str:
    return "-" if sigma is None else f"{sigma:g}"
