# SPDX-License-Identifier: GPL-3.0-or-later
"""The accuracy of the group Subsurface on a slab.

Every record has the `quantity` measured, its `case`, engine and method, the values `expected` and `got`, the relative `error` and,
where pixels show it, the `noise`: the standard error of `got` over `expected`. Lengths are in mm.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import pairwise, product
from typing import NamedTuple

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.closures import subsurface_fit
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.record import Record
from true_diffuse.addon.models.burley import EDGE_WIDTH_25_75, Burley
from true_diffuse.addon.models.half_space import plane_albedo
from true_diffuse.addon.models.medium import MEDIA, Medium
from true_diffuse.addon.nodes import SUBSURFACE
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scenes.slab import Mean, slab
from true_diffuse.scripts.studies import slab_light
from true_diffuse.scripts.studies.edge_profile import edge_width
from true_diffuse.scripts.studies.study import Step, Table, pivot, text


class Method(NamedTuple):
    """A method of subsurface scattering: an engine, and an entry of the group's menu Method."""

    engine: Engine
    entry: str

    @property
    def label(self) -> str:
        """The method's name; EEVEE has one method, whatever the menu says."""
        return "screen space" if self.engine is EEVEE else self.entry

    @property
    def name(self) -> str:
        return f"{self.engine.label}  {self.label}"


WALK, BURLEY = Method(CYCLES, "Random Walk"), Method(CYCLES, "Christensen-Burley")
SCREEN = Method(EEVEE, "Random Walk")
METHODS = (WALK, BURLEY, Method(CYCLES, "Random Walk (Skin)"), Method(CYCLES, "Random Walk (Legacy)"), SCREEN)
CHANNELS = ("red", "green", "blue")
HALF_SPACE = 1000.0  # mean free paths across a slab: white light travels about 20 to either side

RADII = tuple(0.1 * 50.0 ** (k / 10) for k in range(11))  # of rings, in mean free paths, from 0.1 to 5
RING_SAMPLES = 4096  # times 256 pixels: 0.8 % of noise at most, in the ring that holds 1.7 % of the light
PROFILE_ALBEDO = 0.5

MEDIA_SAMPLES = 2048
# Cycles' samples by albedo, more where fewer paths return; the width has 1 % of noise.
EDGE_SAMPLES, EDGE_SIZE = {0.1: 4096, 0.5: 1024, 0.8: 512}, (64, 32)
EDGE_ALBEDOS = tuple(EDGE_SAMPLES)
EDGE_VIEW = 4.0  # edge widths across Cycles' picture
# EEVEE scatters in screen space: its picture needs 32 edge widths, several pixels each; with 8 samples noise is negligible.
SCREEN_VIEW, SCREEN_SIZE, SCREEN_SAMPLES = 32.0, (160, 160), 8
# mean free paths [mm]; EEVEE stores radii in coarse steps, so that small ones are inaccurate
PATHS = {CYCLES.key: (1.0,), EEVEE.key: (100.0, 10.0, 1.0)}
TARGETS = (0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97)
TARGET_MUS = (1.0, 0.5)
# Cycles' fewest and most; darker colors take (1 - color) / color times the fewest, so that noise is at most 0.15 %
TARGET_SAMPLES, TARGET_MAX_SAMPLES = 512, 8192

FURNACE_MUS = (1.0, 0.5, 0.2)
WEIGHTS, ROUGHNESSES = (0.0, 0.5, 1.0), (0.1, 0.4, 1.0)
FURNACE_SAMPLES = {CYCLES.key: 256, EEVEE.key: 16}
FURNACE_PATH = 1.0  # mean free path [mm]

FURNACE_QUANTITIES = ("furnace, specular", "furnace, diffuse", "furnace, subsurface", "furnace, total")
TABLE_SETTING = "Specular 1, roughness 0.4"  # the one that the table shows of a furnace

UNITS = ((1.0, "metres"), (0.01, "centimetres"), (0.001, "millimetres"))
UNIT_METHODS, UNIT_PATH = (WALK, BURLEY, SCREEN), 20.0  # the latter in mm
EXTREME: tuple[tuple[str, tuple[float, float, float], tuple[float, float, float], float], ...] = (
    # case, Color, Subsurface Radius [mm], Blender's unit [m]
    ("mean free path 0", (0.8, 0.5, 0.1), (0.0, 0.0, 0.0), 1.0),
    ("mean free path 0, color 1", (1.0, 1.0, 1.0), (0.0, 0.0, 0.0), 1.0),
    ("mean free path 1e-3 mm, color 1", (1.0, 1.0, 1.0), (1e-3, 1e-3, 1e-3), 1.0),
    ("mean free path 1e-6 mm", (0.8, 0.5, 0.1), (1e-6, 1e-6, 1e-6), 1.0),
    ("mean free path 1 km", (0.8, 0.5, 0.1), (1e6, 1e6, 1e6), 1.0),
    ("mean free paths 1, 0.03, 1e-3 mm", (0.8, 0.5, 0.1), (1.0, 0.03, 1e-3), 1.0),
    ("mean free paths 1, 1e3, 1e-3 mm", (0.8, 0.5, 0.1), (1.0, 1e3, 1e-3), 1.0),
    ("color 0", (0.0, 0.0, 0.0), (1.0, 1.0, 1.0), 1.0),
    ("color 1e-6", (1e-6, 1e-6, 1e-6), (1.0, 1.0, 1.0), 1.0),
    ("color 1", (1.0, 1.0, 1.0), (1.0, 1.0, 1.0), 1.0),
    ("color 0, 1e-6, 1", (0.0, 1e-6, 1.0), (1.0, 1.0, 1.0), 1.0),
    ("scene scale 1e-3", (0.8, 0.5, 0.1), (1.0, 1.0, 1.0), 1e-3),
    ("scene scale 1e3", (0.8, 0.5, 0.1), (1.0, 1.0, 1.0), 1e3),
)
EXTREME_CELL, EXTREME_VIEW = 100.0, 10.0  # mm
EXTREME_SIZE, EXTREME_SAMPLES = (48, 48), 64  # pixels: the mean of a column of 48 has 1 to 2 % of noise


def material(method: Method, color: Sequence[float], path: Sequence[float], **inputs: float) -> bpy.types.Material:
    """Return a material with subsurface scattering alone, unless `inputs` say otherwise; `path` is the mean free path [mm]."""
    settings = {"Method": method.entry, "Color": (*color, 1.0), "Subsurface Radius": tuple(path), "Specular": 0.0, **inputs}
    return materials.create(f"{method.label} {color}", SUBSURFACE, **settings)


def _record(case: str, method: Method, quantity: str, expected: float | None, got: float, noise: float | None = None) -> Record:
    return {
        "case": case,
        "engine": method.engine.key,
        "method": method.label,
        "quantity": quantity,
        "expected": expected,
        "got": got if math.isfinite(got) else None,
        "error": got / expected - 1.0 if expected and math.isfinite(got) else None,
        "noise": noise / expected if noise is not None and expected else None,
    }


def profile(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return the step that yields the light that Cycles' Christensen-Burley spreads into rings, against the closed form.

    Its last record is the RMS error of the rings.
    """

    def measure() -> Iterator[Record]:
        shown = material(BURLEY, (PROFILE_ALBEDO,) * 3, (1.0,) * 3)
        shares, *_ = slab_light.rings(slab(HALF_SPACE), shown, CYCLES, RING_SAMPLES // 4 if quick else RING_SAMPLES, RADII)
        exact = Burley(subsurface_fit.edge_width(PROFILE_ALBEDO) / EDGE_WIDTH_25_75)
        case, errors = f"albedo {PROFILE_ALBEDO:g}", []
        for (inner, outer), got in zip(pairwise(RADII), shares, strict=True):
            expected = PROFILE_ALBEDO * (exact.cdf(outer) - exact.cdf(inner))
            errors.append(got / expected - 1.0)
            yield _record(case, BURLEY, f"share from {inner:.3f} to {outer:.3f} mfp", expected, got)
        rms = math.sqrt(sum(error * error for error in errors) / len(errors))
        yield {**_record(case, BURLEY, "profile, RMS of the rings' errors", 0.0, rms), "error": rms}

    return [Step("Profile  Cycles  Christensen-Burley", measure)] if CYCLES in used else []


def media(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the media's reflectance of a beam at normal incidence, in Random Walk, against the exact one."""

    def measure(method: Method, batch: Sequence[Medium]) -> Iterator[Record]:
        colors = [[plane_albedo(alpha, subsurface_fit.MU) for alpha in medium.albedo] for medium in batch]
        shown = [material(method, color, medium.mean_free_path) for color, medium in zip(colors, batch, strict=True)]
        longest = max(max(medium.mean_free_path) for medium in batch)
        found = slab(HALF_SPACE * longest, len(batch)).albedos(shown, method.engine, _samples(method, MEDIA_SAMPLES))
        for medium, color, means in zip(batch, colors, found, strict=True):
            for channel, expected, mean in zip(CHANNELS, color, means, strict=True):
                yield _record(f"{medium.name}, {channel}", method, "reflectance", expected, *mean)

    return [
        Step(f"Media  {method.name}  {', '.join(medium.name for medium in batch)}", partial(measure, method, batch), len(batch))
        for method in _of((WALK, SCREEN), used)
        for batch in _batches(method, MEDIA[3::5] if quick else MEDIA)
    ]


def _of(chosen: Sequence[Method], used: Sequence[Engine]) -> list[Method]:
    return [method for method in chosen if method.engine in used]


def _batches[T](method: Method, items: Sequence[T]) -> list[Sequence[T]]:
    """Return the items of each picture: all in one in EEVEE, where a picture takes seconds to start; one each in Cycles."""
    return [items] if method.engine is EEVEE else [[item] for item in items]


def _samples(method: Method, samples: int) -> int:
    """Return the samples for an evenly lit slab: in EEVEE one is as good as many."""
    return samples if method.engine is CYCLES else 1


def edges(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the width [mm] of a shadow's edge for several albedos, against the model's."""

    def measure(method: Method, albedo: float, path: float) -> Iterator[Record]:
        case = f"albedo {albedo:g}, mean free path {path:g} mm"
        expected = path * subsurface_fit.edge_width(albedo)
        yield _record(case, method, "edge width [mm]", expected, width(method, albedo, path))

    return [
        Step(f"Edge  {method.name}  albedo {albedo:g}  {path:g} mm", partial(measure, method, albedo, path))
        for method in _of(METHODS, used)
        for albedo in (EDGE_ALBEDOS[1:2] if quick else EDGE_ALBEDOS)
        for path in PATHS[method.engine.key][: 1 if quick else None]
    ]


def width(method: Method, albedo: float, path: float, scale_length: float = 1.0) -> float:
    """Return the 25-75 % width of a shadow's edge [mm]; `albedo` is one of EDGE_ALBEDOS."""
    expected = path * subsurface_fit.edge_width(albedo)
    if method.engine is EEVEE:
        view, size, samples = SCREEN_VIEW * expected, SCREEN_SIZE, SCREEN_SAMPLES
    else:
        view, size, samples = EDGE_VIEW * expected, EDGE_SIZE, EDGE_SAMPLES[albedo]
    body = slab(max(HALF_SPACE * path, 1.5 * view), scale_length=scale_length)
    profile = slab_light.edge(body, material(method, (albedo,) * 3, (path,) * 3), method.engine, samples, size, view)[0]
    return edge_width(profile, view / size[0])


def targets(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the albedo of an evenly lit slab for each Color, at two N.V."""

    def measure(method: Method, mu: float, batch: Sequence[float]) -> Iterator[Record]:
        shown, darkest = [material(method, (color,) * 3, (1.0,) * 3) for color in batch], min(batch)
        most = min(TARGET_MAX_SAMPLES, max(TARGET_SAMPLES, int(TARGET_SAMPLES * (1.0 - darkest) / darkest)))
        found = slab(HALF_SPACE, len(batch)).albedos(shown, method.engine, _samples(method, most), mu)
        for color, (mean, *_) in zip(batch, found, strict=True):
            yield _record(f"color {color:g}, N.V {mu:g}", method, "albedo", color, *mean)

    return [
        Step(f"Albedo  {method.name}  {', '.join(map(str, batch))}  N.V {mu:g}", partial(measure, method, mu, batch), len(batch))
        for method in _of(METHODS, used)
        for mu in (TARGET_MUS[:1] if quick else TARGET_MUS)
        for batch in _batches(method, TARGETS[1::2] if quick else TARGETS)
    ]


class Setting(NamedTuple):
    """The group's inputs in a furnace."""

    subsurface: float
    specular: float
    roughness: float


SETTINGS = [Setting(*row) for row in ((w, s, r) for s in WEIGHTS for r in ROUGHNESSES for w in WEIGHTS)]


def furnace(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the specular, diffuse and subsurface light of the white group in a white world, one for each N.V.

    With a black Color all light is specular; the rest is diffuse at Subsurface 0, subsurface at 1, and mixed in proportion between.
    The total is compared with the sum of these.
    """
    body, world = slab(HALF_SPACE * FURNACE_PATH, 9, 3), uniform_world()

    def measure(method: Method, mu: float) -> Iterator[Record]:
        samples = FURNACE_SAMPLES[method.engine.key]
        white, black = (
            [mean for mean, *_ in body.albedos(_grid(method, color), method.engine, samples, mu, world)] for color in (1.0, 0.0)
        )
        total, specular = (dict(zip(SETTINGS, means, strict=True)) for means in (white, black))
        for setting in SETTINGS:
            yield from _split(method, mu, setting, total, specular)
        yield _record(f"N.V {mu:g}", method, "furnace, greatest total", 1.0, *max(total.values()))
        yield _record(f"N.V {mu:g}", method, "furnace, beyond monotone", 0.0, _beyond_monotone(total))

    cases = product(_of((WALK, SCREEN), used), FURNACE_MUS[1:2] if quick else FURNACE_MUS)
    return [Step(f"Furnace  {method.name}  N.V {mu:g}", partial(measure, method, mu)) for method, mu in cases]


def _beyond_monotone(total: dict[Setting, Mean]) -> float:
    """Return the most by which the total at half a weight lies outside the totals at its ends."""
    worst = 0.0
    for setting, middle in total.items():
        for name in ("subsurface", "specular"):
            if getattr(setting, name) == WEIGHTS[1]:
                ends = [total[setting._replace(**{name: end})].value for end in (WEIGHTS[0], WEIGHTS[2])]
                worst = max(worst, middle.value - max(ends), min(ends) - middle.value)
    return worst


def _grid(method: Method, color: float) -> list[bpy.types.Material]:
    names = ("Subsurface", "Specular", "Specular Roughness")
    inputs = (dict(zip(names, setting, strict=True)) for setting in SETTINGS)
    return [material(method, (color,) * 3, (FURNACE_PATH,) * 3, **weights) for weights in inputs]


def _split(
    method: Method, mu: float, setting: Setting, total: dict[Setting, Mean], specular: dict[Setting, Mean]
) -> Iterator[Record]:
    weight, case = setting.subsurface, f"Subsurface {setting.subsurface:g}, Specular {setting.specular:g}"
    case += f", roughness {setting.roughness:g}, N.V {mu:g}"
    coat = specular[setting].value
    diffuse, scattered = (total[setting._replace(subsurface=end)].value - coat for end in (0.0, 1.0))
    parts = (coat, (1.0 - weight) * diffuse, weight * scattered)
    for quantity, part in zip(FURNACE_QUANTITIES, parts, strict=False):
        yield _record(case, method, quantity, None, part)
    yield _record(case, method, FURNACE_QUANTITIES[-1], sum(parts), *total[setting])


def units(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the width of an edge on the same slab modelled in several scene units."""

    def measure(method: Method, scale_length: float, name: str) -> Iterator[Record]:
        expected = UNIT_PATH * subsurface_fit.edge_width(0.5)
        yield _record(f"slab in {name}", method, "edge width [mm]", expected, width(method, 0.5, UNIT_PATH, scale_length))

    cases = product(_of(UNIT_METHODS[1:2] if quick else UNIT_METHODS, used), UNITS)
    return [Step(f"Units  {method.name}  {unit[1]}", partial(measure, method, *unit)) for method, unit in cases]


def extreme(used: Sequence[Engine], quick: bool) -> list[Step]:
    """Return steps that yield the smallest and largest radiance of half-shadowed slabs with extreme inputs.

    Scattering cannot raise it above 1, except for noise. `got` is None where a value is not finite.
    """

    def measure(method: Method, case: str, color: Sequence[float], path: Sequence[float], scale_length: float) -> Iterator[Record]:
        body, samples = slab(EXTREME_CELL, scale_length=scale_length), _samples(method, EXTREME_SAMPLES)
        profiles = slab_light.edge(body, material(method, color, path), method.engine, samples, EXTREME_SIZE, EXTREME_VIEW)
        values = [value for profile in profiles for value in profile]
        least, greatest = (min(values), max(values)) if all(map(math.isfinite, values)) else (math.nan, math.nan)
        yield {**_record(case, method, "least", 0.0, least), "error": max(0.0, -least)}
        yield {**_record(case, method, "greatest", 1.0, greatest), "error": max(0.0, greatest - 1.0)}

    cases = product(_of(METHODS[:1] if quick else METHODS, used), EXTREME)
    return [Step(f"Extremes  {method.name}  {row[0]}", partial(measure, method, *row)) for method, row in cases]


SECTIONS: dict[str, Callable[[Sequence[Engine], bool], list[Step]]] = {
    "Profile of Christensen-Burley": profile,
    "Reflectance of the twelve media": media,
    "Width of a shadow's edge, 25 to 75 %": edges,
    "Albedo of an evenly lit slab": targets,
    "White furnace": furnace,
    "Unit scale": units,
    "Extreme inputs, half in shadow": extreme,
}


def table(records: Sequence[Record]) -> Table:
    """Return each method's value and, in brackets, its error in percent."""

    def row(one: Record) -> tuple[str, ...]:
        return one["case"], one["quantity"], text(one["expected"], ".4g")

    def column(one: Record) -> str:
        return f"{one['engine']}, {one['method']}"

    shown = [one for one in records if one["quantity"] not in FURNACE_QUANTITIES or TABLE_SETTING in one["case"]]
    return pivot(shown, ("Case", "Quantity", "Expected"), row, column, lambda found: _got(found[0]))


def _got(record: Record) -> str:
    if record["got"] is None:
        return "not finite"
    return f"{record['got']:.4g}" + ("" if record["error"] is None else f" ({100.0 * record['error']:+.1f})")
