# SPDX-License-Identifier: GPL-3.0-or-later
"""How near each target of a model comes to its formula: records for the accuracy report."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from itertools import product

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.lobe import CYCLES as CYCLES_LOBES
from true_diffuse.addon.closures.lobe import PAIR, SIGNED, SINGLE
from true_diffuse.addon.closures.lobe_error import lobe_error
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.record import Record, known
from true_diffuse.addon.models import MODELS, Lambert, Model, ReflectanceModel, Specular
from true_diffuse.addon.models.registry import IOR
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, Group, chosen_lights
from true_diffuse.scenes.sphere import COLOR, SphereUnderSun
from true_diffuse.scripts.studies import lit_sphere, osl_values
from true_diffuse.scripts.studies.lit_sphere import area_light, sky, three_lights
from true_diffuse.scripts.studies.study import Step, Table, percent, pivot, text

SIGMAS = (0.2, 0.33, 1.0)
LIGHT_DEGREES = (0.0, 30.0, 60.0, 90.0, 120.0)  # between light and viewer
QUICK_SIGMAS = (0.33,)
QUICK_LIGHT_DEGREES = (0.0, 60.0, 120.0)
OTHER_SIGMAS = (0.33, 1.0)  # for the models beside the paper's own
ENGINES_SAMPLES = 16  # of EEVEE where it is held against Cycles: its area lamps are noisy
SOFT_SAMPLES = 4  # of EEVEE under one area light: with 64 its differences are the same within 0.02 %, at 130 degrees 0.3 %
OSL_WORK = 20.0  # the measured lobe errors take as long as so many records
SOFT_DISTANCE = 4.3  # m, of area lights
SOFT_SIZES, QUICK_SOFT_SIZES = (0.1, 0.5, 1.5, 3.0), (1.5,)  # m
SOFT_DEGREES, QUICK_SOFT_DEGREES = tuple(map(float, range(0, 151, 10))), (0.0, 60.0, 110.0, 130.0)  # between light and viewer
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

    @property
    def sigmas(self) -> tuple[float, ...]:
        """The roughnesses at which a model beside the paper's own is measured."""
        return OTHER_SIGMAS if self.is_rough else OTHER_SIGMAS[:1]

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
QUICK_MODELS = (PAPER, EON)


@dataclass(frozen=True)
class Configuration:
    """How to render a model; `lobe_set` names its lobes, from which the lobe error follows; OSL's is measured.

    `in_shadow`: the quality for chosen lights follows another sun, too, from above, whose light is all in shadow.
    """

    engine: Engine
    quality: str
    lobe_set: str | None = None
    osl: bool = False
    in_shadow: bool = False

    @property
    def record(self) -> Record:
        """What every record of it has."""
        quality = f"{self.quality}, another in shadow" if self.in_shadow else self.quality
        return {"target": "osl" if self.osl else "nodes", "engine": self.engine.key, "quality": quality}

    @property
    def name(self) -> str:
        return "  ".join(self.record.values())

    def renders(self, measured: MeasuredModel) -> bool:
        """Return whether the target has the model."""
        return not (self.osl and measured.model and measured.model.osl is None)


CONFIGURATIONS = (
    Configuration(EEVEE, FAST, SINGLE),
    Configuration(EEVEE, BALANCED, PAIR),
    Configuration(EEVEE, PRECISE, SIGNED),
    Configuration(EEVEE, CHOSEN_LIGHTS),
    Configuration(CYCLES, BALANCED, CYCLES_LOBES),
    Configuration(CYCLES, CHOSEN_LIGHTS),
    Configuration(CYCLES, BALANCED, osl=True),
)
SPECULAR_CONFIGURATIONS = tuple(Configuration(*each) for each in product((EEVEE, CYCLES), (BALANCED, CHOSEN_LIGHTS)))
IN_SHADOW = Configuration(CYCLES, CHOSEN_LIGHTS, in_shadow=True)


def configurations(
    used: Sequence[Engine], measured: Iterable[MeasuredModel], among: Iterable[Configuration] = CONFIGURATIONS
) -> list[tuple[Configuration, MeasuredModel]]:
    """Return each configuration of the engines `used` with each model that it renders."""
    return [(one, each) for one, each in product(among, measured) if one.engine in used and one.renders(each)]


@dataclass(frozen=True)
class Case:
    """A model of some roughness, rendered some way; `shown` is what stands in for it where that is another model."""

    configuration: Configuration
    measured: MeasuredModel
    sigma: float
    shown: MeasuredModel | None = None

    @property
    def record(self) -> Record:
        """What every record of it has."""
        quality = {"quality": "plain Lambert"} if self.shown else {}
        sigma = self.sigma if self.measured.is_rough else None
        return {**self.configuration.record, **quality, "model": self.measured.name, "sigma": sigma}


def cases(used: Sequence[Engine], quick: bool) -> list[Case]:
    """Return what to measure with the engines `used`: the paper's model first, as Lambert too, then the others, then specular."""
    result = []
    for engine in used:
        own = [each for each in CONFIGURATIONS if each.engine is engine and (compiles_osl() or not each.osl)]
        shadow = [IN_SHADOW] if engine is IN_SHADOW.engine and not quick else []
        sigmas = QUICK_SIGMAS if quick else SIGMAS
        result += [Case(Configuration(engine, BALANCED), PAPER, sigma, LAMBERT) for sigma in sigmas]
        result += [Case(each, PAPER, sigma) for each in own + shadow for sigma in sigmas]
        if not quick:
            result += [Case(c, other, sigma) for other in OTHERS for c in own if c.renders(other) for sigma in other.sigmas]
            result += [Case(each, SPECULAR, 0.0) for each in (*SPECULAR_CONFIGURATIONS, *shadow) if each.engine is engine]
    return result


def rough(sphere: SphereUnderSun, used: Sequence[Engine], samples: int, quick: bool) -> list[Step]:
    """Return a step for each case and angle of the light, whose record has the sphere's RMS error and the lobe error, as fractions.

    The lobe error is None where the light is what decides.
    """
    other = sphere.sun.copy()  # shines from its own z axis: from above
    other.matrix_world.identity()
    every, osl_errors = cases(used, quick), dict[Case, float]()
    chosen = {case: case.measured.model.id for case in every if case.configuration.osl and case.measured.model}

    def measure_osl_lobes() -> Iterator[Record]:
        shown = [osl_values.Shown(model, case.measured.formula(case.sigma), case.sigma) for case, model in chosen.items()]
        osl_errors.update(zip(chosen, osl_values.lobe_errors(shown), strict=True))
        return iter(())

    @cache
    def prepare(case: Case) -> tuple[bpy.types.Material, float | None]:
        """Return the material and the lobe error of a case, with the scene ready for it."""
        configuration, model, shown = case.configuration, case.measured.formula(case.sigma), case.shown or case.measured
        chosen_lights.choose([sphere.sun, other] if configuration.in_shadow else [sphere.sun])
        sphere.scene.cycles.shading_system = configuration.osl
        rendered = Lambert() if case.shown else Rendered(model, configuration.lobe_set) if configuration.lobe_set else None
        material = shown.material(configuration.quality, Color=COLOR, **({"Roughness": case.sigma} if shown.is_rough else {}))
        return material, lobe_error(rendered, model) if rendered else osl_errors.get(case)

    def measure(case: Case, degrees: float) -> Iterator[Record]:
        material, error_of_lobes = prepare(case)
        model, engine = case.measured.formula(case.sigma), case.configuration.engine
        seconds, (errors,) = sphere.measure(material, (model,), engine, samples, degrees)
        yield {
            **case.record,
            "light_degrees": degrees,
            "samples": samples,
            "rms_error": known(errors.rms),
            "lobe_error": error_of_lobes,
            "render_seconds": seconds,
        }

    steps = [Step("osl  lobe errors", measure_osl_lobes, OSL_WORK)] if chosen else []
    for case, degrees in product(every, QUICK_LIGHT_DEGREES if quick else LIGHT_DEGREES):
        about = filter(None, map(str, case.record.values()))
        steps.append(Step(f"{'  '.join(about)}  {degrees:g} degrees", partial(measure, case, degrees)))
    return steps


def between_engines(sphere: SphereUnderSun) -> list[Step]:
    """Return a step for each quality of EEVEE and sigma: its RMS difference from Cycles under three lights, a sky, and both.

    Cycles renders the same material without OSL.
    """
    lights, world = three_lights(), sky(*SKY)
    pairs = [(LAMBERT, BALANCED, 0.0)]
    for quality in (FAST, BALANCED, PRECISE):
        pairs += [(PAPER, quality, sigma) for sigma in SIGMAS] + [(EVERY["cycles_diffuse"], quality, 0.33)]
    lit_by = {"lights": (lights, None), "sky": ((), world), "lights and sky": (lights, world)}

    def measure(measured: MeasuredModel, quality: str, sigma: float) -> Iterator[Record]:
        material = measured.material(quality, Color=COLOR, Roughness=sigma)
        for light, (used, background) in lit_by.items():
            seconds, difference = lit_sphere.between_engines(sphere, material, used, background, ENGINES_SAMPLES)
            yield _difference(measured, quality, sigma, ENGINES_SAMPLES, seconds, difference) | {"light": light}

    return [Step(f"EEVEE and Cycles  {pair[1]}  {pair[0].name}  {pair[2]:g}", partial(measure, *pair)) for pair in pairs]


def _difference(measured: MeasuredModel, quality: str, sigma: float, samples: int, seconds: float, difference: float) -> Record:
    """Return the record of how far EEVEE is from Cycles, without the light."""
    return {
        "quality": quality,
        "model": measured.name,
        "sigma": sigma if measured.is_rough else None,
        "samples": samples,
        "rms_difference": known(difference),
        "render_seconds": seconds,
    }


def soft(sphere: SphereUnderSun, quick: bool) -> list[Step]:
    """Return a step for each material and size of an area light: EEVEE's RMS difference from Cycles, without bounces, by its angle.

    What Lambert differs by is the engines' own: their shadows at the terminator, and how they integrate a light over its area.
    Cycles renders with Open Shading Language, which is nearer to equation (1) and the 1994 model than its closures.
    """
    sphere.scene.cycles.shading_system = compiles_osl()
    sizes, angles = (QUICK_SOFT_SIZES, QUICK_SOFT_DEGREES) if quick else (SOFT_SIZES, SOFT_DEGREES)
    models = (PAPER,) if quick else (PAPER, *(EVERY[name] for name in ("fujii", "eon", "cycles_diffuse", "oren_nayar_1994")))
    sigmas = QUICK_SIGMAS if quick else OTHER_SIGMAS
    cases = [(LAMBERT, BALANCED, 0.0), *product((PAPER,), (BALANCED,), sigmas), *product(models, (PRECISE,), sigmas)]

    def measure(measured: MeasuredModel, quality: str, sigma: float, size: float) -> Iterator[Record]:
        material = measured.material(quality, Color=COLOR, **({"Roughness": sigma} if measured.is_rough else {}))
        for degrees in angles:
            light = area_light(degrees, size, SOFT_DISTANCE)
            seconds, difference = lit_sphere.between_engines(sphere, material, [light], None, SOFT_SAMPLES)
            bpy.data.lights.remove(light.data)
            found = _difference(measured, quality, sigma, SOFT_SAMPLES, seconds, difference)
            yield found | {"light_size": size, "light_degrees": degrees}

    return [
        Step(f"Soft light  {quality}  {each.name}  {sigma:g}  {size:g} m", partial(measure, each, quality, sigma, size))
        for (each, quality, sigma), size in product(cases, sizes)
    ]


def soft_table(records: Sequence[Record]) -> Table:
    """Return a row for each material and size of the light, a column for each angle, in %."""

    def row(one: Record) -> tuple[str, ...]:
        return one["quality"], one["model"], text(one["sigma"]), f"{one['light_size']:g} m"

    titles = ("Quality", "Model", "Sigma", "Light")

    def cell(found: list[Record]) -> str:
        return percent(found[0]["rms_difference"], ".1f")

    return pivot(records, titles, row, lambda one: f"{one['light_degrees']:g}\u00b0", cell)


def beyond_lambert_table(records: Sequence[Record]) -> Table:
    """Return the same in percentage points beyond what Lambert differs by under the same light."""
    lambert = {(one["light_size"], one["light_degrees"]): one["rms_difference"] for one in records if one["model"] == LAMBERT.name}
    others = [
        {**one, "rms_difference": one["rms_difference"] - lambert[one["light_size"], one["light_degrees"]]}
        for one in records
        if one["model"] != LAMBERT.name and (one["light_size"], one["light_degrees"]) in lambert
    ]
    return soft_table(others)


def rough_table(records: Sequence[Record]) -> Table:
    """Return a row for each case: its errors in %, those of all angles side by side."""

    def row(one: Record) -> tuple[str, ...]:
        way = one["target"] if one["target"] == "osl" else one["quality"]
        return f"{one['engine']} {way}", one["model"], text(one["sigma"]), percent(one["lobe_error"])

    titles = ("Configuration", "Model", "Sigma", "Lobes")
    return pivot(records, titles, row, lambda one: f"{one['light_degrees']:g}\u00b0", lambda found: percent(found[0]["rms_error"]))


def between_engines_table(records: Sequence[Record]) -> Table:
    """Return a row for each material, in %."""
    titles = ("Quality", "Model", "Sigma")

    def row(one: Record) -> tuple[str, ...]:
        return one["quality"], one["model"], text(one["sigma"])

    return pivot(records, titles, row, lambda one: one["light"], lambda found: percent(found[0]["rms_difference"]))
