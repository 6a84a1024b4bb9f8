# SPDX-License-Identifier: GPL-3.0-or-later
"""How near the group Subsurface comes to its model on a slab: records for the accuracy report.

Every record has what was measured (`quantity`) of what (`case`), by which engine and method, `expected` and `got`, the `error` and,
where pixels show it, the `noise`, which is the standard error of `got`; both as shares of `expected`. Lengths in mm.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, Engine
from true_diffuse.addon.closures import subsurface_fit
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.record import Progress, Record
from true_diffuse.addon.models import EDGE_WIDTH_25_75, MEDIA, Burley, plane_albedo
from true_diffuse.addon.nodes import SUBSURFACE
from true_diffuse.scenes.elements import uniform_world
from true_diffuse.scenes.slab import Mean, slab
from true_diffuse.scripts.studies.edge_profile import edge_width


class Way(NamedTuple):
    """A way to scatter light below a surface; `method` as the group's menu has it."""

    engine: Engine
    method: str

    @property
    def label(self) -> str:
        """EEVEE has one method, whatever the menu says."""
        return "screen space" if self.engine is EEVEE else self.method


WALK, BURLEY = Way(CYCLES, "Random Walk"), Way(CYCLES, "Christensen-Burley")
SCREEN = Way(EEVEE, "Random Walk")
WAYS = (WALK, BURLEY, Way(CYCLES, "Random Walk (Skin)"), Way(CYCLES, "Random Walk (Legacy)"), SCREEN)
CHANNELS = ("red", "green", "blue")
HALF_SPACE = 1000.0  # mean free paths across a slab: white light walks some 20 to either side

RADII = tuple(0.1 * 50.0 ** (k / 10) for k in range(11))  # of rings, in mean free paths, from 0.1 to 5
RING_SAMPLES = 4096  # times 256 pixels: 0.8 % of noise at most, in the ring that holds 1.7 % of the light
PROFILE_ALBEDO = 0.5

MEDIA_SAMPLES = 2048
# Cycles' samples by albedo: the fewer paths come back, the more; the width has 1 % of noise.
EDGE_SAMPLES, EDGE_SIZE = {0.1: 4096, 0.5: 1024, 0.8: 512}, (64, 32)
EDGE_ALBEDOS = tuple(EDGE_SAMPLES)
EDGE_VIEW = 4.0  # edge widths across Cycles' picture
# EEVEE's picture needs 32 edge widths for what it scatters, and some pixels for each of them; 8 samples have no noise to speak of.
SCREEN_VIEW, SCREEN_SIZE, SCREEN_SAMPLES = 32.0, (160, 160), 8
# mm: EEVEE keeps radii in coarse steps, so that small ones are off
PATHS = {CYCLES.key: (1.0,), EEVEE.key: (100.0, 10.0, 1.0)}
TARGETS = (0.05, 0.1, 0.3, 0.5, 0.7, 0.9, 0.97)
TARGET_MUS = (1.0, 0.5)
# of Cycles: at least, and (1 - color) / color times as many for darker colors, so that the noise is 0.15 % at most
TARGET_SAMPLES, TARGET_MOST = 512, 8192

FURNACE_MUS = (1.0, 0.5, 0.2)
WEIGHTS, ROUGHNESSES = (0.0, 0.5, 1.0), (0.1, 0.4, 1.0)
FURNACE_SAMPLES = {CYCLES.key: 256, EEVEE.key: 16}
FURNACE_PATH = 1.0  # mm, in cells of HALF_SPACE of it

PARTS_OF_LIGHT = ("furnace, specular", "furnace, diffuse", "furnace, subsurface", "furnace, total")
SHOWN = "Specular 1, roughness 0.4"  # of them in the table

UNITS = ((1.0, "metres"), (0.01, "centimetres"), (0.001, "millimetres"))
UNIT_WAYS, UNIT_PATH = (WALK, BURLEY, SCREEN), 20.0  # the last in mm
STIFF: tuple[tuple[str, tuple[float, float, float], tuple[float, float, float], float], ...] = (
    # case, Color, Mean Free Path [mm], Blender's unit [m]
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
STIFF_CELL, STIFF_VIEW = 100.0, 10.0  # mm
STIFF_SIZE, STIFF_SAMPLES = (48, 48), 64  # pixels: the mean of a column of 48 has 1 to 2 % of noise


def material(way: Way, color: Sequence[float], path: Sequence[float], **inputs: float) -> bpy.types.Material:
    """Return a material that scatters below its surface alone unless `inputs` say otherwise; `path` in mm."""
    settings = {"Method": way.method, "Color": (*color, 1.0), "Subsurface Radius": tuple(path), "Specular": 0.0, **inputs}
    return materials.create(f"{way.label} {color}", SUBSURFACE, **settings)


def _record(case: str, way: Way, quantity: str, expected: float | None, got: float, noise: float | None = None) -> Record:
    return {
        "case": case,
        "engine": way.engine.key,
        "method": way.label,
        "quantity": quantity,
        "expected": expected,
        "got": got if math.isfinite(got) else None,
        "error": got / expected - 1.0 if expected and math.isfinite(got) else None,
        "noise": noise / expected if noise is not None and expected else None,
    }


def profile(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield the light that Christensen-Burley in Cycles spreads into rings, against the closed form, and the RMS error of all.

    One unit of work to `progress`.
    """
    if CYCLES not in used:
        return
    with progress.step("Profile  Cycles  Christensen-Burley", 1.0):
        shown = material(BURLEY, (PROFILE_ALBEDO,) * 3, (1.0,) * 3)
        shares, *_ = slab(HALF_SPACE).rings(shown, CYCLES, RING_SAMPLES // 4 if quick else RING_SAMPLES, RADII)
    exact = Burley(subsurface_fit.edge_width(PROFILE_ALBEDO) / EDGE_WIDTH_25_75)
    errors = []
    for (inner, outer), got in zip(pairwise(RADII), shares, strict=True):
        expected = PROFILE_ALBEDO * (exact.cdf(outer) - exact.cdf(inner))
        errors.append(got / expected - 1.0)
        yield _record(f"albedo {PROFILE_ALBEDO:g}", BURLEY, f"share from {inner:.3f} to {outer:.3f} mfp", expected, got)
    rms = math.sqrt(sum(error * error for error in errors) / len(errors))
    yield {**_record(f"albedo {PROFILE_ALBEDO:g}", BURLEY, "profile, RMS of the rings' errors", 0.0, rms), "error": rms}


def media(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield what each of the twelve media reflects of a beam along the normal, in Random Walk, against the exact reflectance.

    Each medium is one unit of work to `progress`.
    """
    chosen = MEDIA[3::5] if quick else MEDIA
    for way in _of((WALK, SCREEN), used):
        for group in _together(way, chosen):
            names = ", ".join(medium.name for medium in group)
            with progress.step(f"Media  {way.engine.label}  {names}", len(group)):
                colors = [[plane_albedo(alpha, subsurface_fit.MU) for alpha in medium.albedo] for medium in group]
                shown = [material(way, color, medium.mean_free_path) for color, medium in zip(colors, group, strict=True)]
                longest = max(max(medium.mean_free_path) for medium in group)
                found = slab(HALF_SPACE * longest, len(group)).albedos(shown, way.engine, _samples(way, MEDIA_SAMPLES))
            for medium, color, means in zip(group, colors, found, strict=True):
                for channel, expected, mean in zip(CHANNELS, color, means, strict=True):
                    yield _record(f"{medium.name}, {channel}", way, "reflectance", expected, *mean)


def _of(chosen: Sequence[Way], used: Sequence[Engine]) -> list[Way]:
    return [way for way in chosen if way.engine in used]


def _together[T](way: Way, items: Sequence[T]) -> list[Sequence[T]]:
    """Return what goes into one picture: all in EEVEE, where a picture takes seconds to start; each by itself in Cycles."""
    return [items] if way.engine is EEVEE else [[item] for item in items]


def _samples(way: Way, wanted: int) -> int:
    """Return the samples of a slab lit all over: in EEVEE one is as good as many."""
    return wanted if way.engine is CYCLES else 1


def edges(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield the width of a shadow's edge for some albedos, against the model's [mm]. Each is one unit of work to `progress`."""
    for way in _of(WAYS, used):
        for albedo in EDGE_ALBEDOS[1:2] if quick else EDGE_ALBEDOS:
            for path in PATHS[way.engine.key][: 1 if quick else None]:
                with progress.step(f"Edge  {way.engine.label}  {way.label}  albedo {albedo:g}  {path:g} mm", 1.0):
                    got = width(way, albedo, path)
                case = f"albedo {albedo:g}, mean free path {path:g} mm"
                yield _record(case, way, "edge width [mm]", path * subsurface_fit.edge_width(albedo), got)


def width(way: Way, albedo: float, path: float, scale_length: float = 1.0) -> float:
    """Return the 25-75 % width of a shadow's edge [mm]; `albedo` is one of EDGE_ALBEDOS."""
    expected = path * subsurface_fit.edge_width(albedo)
    if way.engine is EEVEE:
        view, size, samples = SCREEN_VIEW * expected, SCREEN_SIZE, SCREEN_SAMPLES
    else:
        view, size, samples = EDGE_VIEW * expected, EDGE_SIZE, EDGE_SAMPLES[albedo]
    body = slab(max(HALF_SPACE * path, 1.5 * view), scale_length=scale_length)
    profile = body.edge(material(way, (albedo,) * 3, (path,) * 3), way.engine, samples, size, view)[0]
    return edge_width(profile, view / size[0])


def targets(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield what a slab lit all over shows of each color asked for, at two N.V. Each is one unit of work to `progress`."""
    for way in _of(WAYS, used):
        for mu in TARGET_MUS[:1] if quick else TARGET_MUS:
            for group in _together(way, TARGETS[1::2] if quick else TARGETS):
                colors = ", ".join(f"{color:g}" for color in group)
                with progress.step(f"Albedo  {way.engine.label}  {way.label}  {colors}  N.V {mu:g}", len(group)):
                    shown = [material(way, (color,) * 3, (1.0,) * 3) for color in group]
                    darkest = min(group)
                    wanted = min(TARGET_MOST, max(TARGET_SAMPLES, int(TARGET_SAMPLES * (1.0 - darkest) / darkest)))
                    found = slab(HALF_SPACE, len(group)).albedos(shown, way.engine, _samples(way, wanted), mu)
                for color, (mean, *_) in zip(group, found, strict=True):
                    yield _record(f"color {color:g}, N.V {mu:g}", way, "albedo", color, *mean)


class Setting(NamedTuple):
    """The weights of the group in a furnace."""

    subsurface: float
    specular: float
    roughness: float


SETTINGS = [Setting(*row) for row in ((w, s, r) for s in WEIGHTS for r in ROUGHNESSES for w in WEIGHTS)]


def furnace(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield how the white group splits the light of a white world, and the sum of the parts. Each N.V is one unit to `progress`.

    What is left with a black Color is specular; that subtracted, the rest at Subsurface 0 is diffuse, at 1 subsurface, and between
    them in proportion. `error` is that of the sum, which the total is held against.
    """
    body, world = slab(HALF_SPACE * FURNACE_PATH, 9, 3), uniform_world()
    for way in _of((WALK, SCREEN), used):
        for mu in FURNACE_MUS[1:2] if quick else FURNACE_MUS:
            with progress.step(f"Furnace  {way.engine.label}  N.V {mu:g}", 1.0):
                white, black = (
                    [mean for mean, *_ in body.albedos(_grid(way, color), way.engine, FURNACE_SAMPLES[way.engine.key], mu, world)]
                    for color in (1.0, 0.0)
                )
            total, specular = (dict(zip(SETTINGS, means, strict=True)) for means in (white, black))
            for setting in SETTINGS:
                yield from _split(way, mu, setting, total, specular)
            brightest = max(total.values())
            yield _record(f"N.V {mu:g}", way, "furnace, greatest total", 1.0, *brightest)
            yield _record(f"N.V {mu:g}", way, "furnace, beyond monotone", 0.0, _beyond_monotone(total))


def _beyond_monotone(total: dict[Setting, Mean]) -> float:
    """Return by how much a total at half a weight is above or below those at both of its ends, at most."""
    worst = 0.0
    for setting, middle in total.items():
        for name in ("subsurface", "specular"):
            if getattr(setting, name) == WEIGHTS[1]:
                ends = [total[setting._replace(**{name: end})].value for end in (WEIGHTS[0], WEIGHTS[2])]
                worst = max(worst, middle.value - max(ends), min(ends) - middle.value)
    return worst


def _grid(way: Way, color: float) -> list[bpy.types.Material]:
    return [
        material(
            way,
            (color,) * 3,
            (FURNACE_PATH,) * 3,
            **{"Subsurface": setting.subsurface, "Specular": setting.specular, "Specular Roughness": setting.roughness},
        )
        for setting in SETTINGS
    ]


def _split(way: Way, mu: float, setting: Setting, total: dict[Setting, Mean], specular: dict[Setting, Mean]) -> Iterator[Record]:
    weight, case = setting.subsurface, f"Subsurface {setting.subsurface:g}, Specular {setting.specular:g}"
    case += f", roughness {setting.roughness:g}, N.V {mu:g}"
    coat = specular[setting].value
    diffuse, scattered = (total[setting._replace(subsurface=end)].value - coat for end in (0.0, 1.0))
    parts = (coat, (1.0 - weight) * diffuse, weight * scattered)
    for quantity, part in zip(PARTS_OF_LIGHT, parts, strict=False):
        yield _record(case, way, quantity, None, part)
    yield _record(case, way, PARTS_OF_LIGHT[-1], sum(parts), *total[setting])


def units(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield the width of an edge on the same slab modelled in several units. Each is one unit to `progress`."""
    for way in _of((UNIT_WAYS[1:2] if quick else UNIT_WAYS), used):
        for scale_length, name in UNITS:
            with progress.step(f"Units  {way.engine.label}  {way.label}  {name}", 1.0):
                got = width(way, 0.5, UNIT_PATH, scale_length)
            yield _record(f"slab in {name}", way, "edge width [mm]", UNIT_PATH * subsurface_fit.edge_width(0.5), got)


def stiff(used: Sequence[Engine], quick: bool, progress: Progress) -> Iterator[Record]:
    """Yield the least and the greatest value of slabs with inputs at their ends, half in shadow. Each is one unit to `progress`.

    Light, at most 1 everywhere, cannot become more by scattering, but for noise. `got` is None where a value is not finite.
    """
    for way in _of(WAYS[:1] if quick else WAYS, used):
        for case, color, path, scale_length in STIFF:
            with progress.step(f"Stiff  {way.engine.label}  {way.label}  {case}", 1.0):
                body, samples = slab(STIFF_CELL, scale_length=scale_length), _samples(way, STIFF_SAMPLES)
                profiles = body.edge(material(way, color, path), way.engine, samples, STIFF_SIZE, STIFF_VIEW)
            values = [value for profile in profiles for value in profile]
            least, greatest = (min(values), max(values)) if all(map(math.isfinite, values)) else (math.nan, math.nan)
            yield {**_record(case, way, "least", 0.0, least), "error": max(0.0, -least)}
            yield {**_record(case, way, "greatest", 1.0, greatest), "error": max(0.0, greatest - 1.0)}


class Part(NamedTuple):
    """A part of the measure; `work` says how many units `records` counts, where `quick` may be."""

    title: str
    records: Callable[[Sequence[Engine], bool, Progress], Iterator[Record]]
    work: Callable[[Sequence[Engine], bool], int]


def _edges_work(used: Sequence[Engine], quick: bool) -> int:
    return sum(1 if quick else len(EDGE_ALBEDOS) * len(PATHS[way.engine.key]) for way in _of(WAYS, used))


def _targets_work(used: Sequence[Engine], quick: bool) -> int:
    return len(_of(WAYS, used)) * (len(TARGETS[1::2]) if quick else len(TARGETS) * len(TARGET_MUS))


PARTS = (
    Part("Profile of Christensen-Burley", profile, lambda used, _quick: int(CYCLES in used)),
    Part("Reflectance of the twelve media", media, lambda used, quick: len(used) * len(MEDIA[3::5] if quick else MEDIA)),
    Part("Width of a shadow's edge, 25 to 75 %", edges, _edges_work),
    Part("Albedo of a slab lit all over", targets, _targets_work),
    Part("White furnace", furnace, lambda used, quick: len(used) * (1 if quick else len(FURNACE_MUS))),
    Part("Unit scale", units, lambda used, quick: len(UNITS) * len(_of((UNIT_WAYS[1:2] if quick else UNIT_WAYS), used))),
    Part("Stiff inputs, half in shadow", stiff, lambda used, quick: len(STIFF) * len(_of(WAYS[:1] if quick else WAYS, used))),
)


def table(records: Sequence[Record]) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return columns and rows for people: what each way gives and, in brackets, its error in %; of a furnace one split."""
    columns = list(dict.fromkeys(_column(record) for record in records))
    groups: dict[tuple[str, ...], dict[str, str]] = {}
    for record in records:
        if record["quantity"] not in PARTS_OF_LIGHT or SHOWN in record["case"]:
            expected = "-" if record["expected"] is None else f"{record['expected']:.4g}"
            groups.setdefault((record["case"], record["quantity"], expected), {})[_column(record)] = _got(record)
    rows: list[tuple[str, ...]] = [(*key, *(row.get(column, "-") for column in columns)) for key, row in groups.items()]
    return ("Case", "Quantity", "Expected", *columns), rows


def _column(record: Record) -> str:
    return f"{record['engine']}, {record['method']}"


def _got(record: Record) -> str:
    if record["got"] is None:
        return "not finite"
    return f"{record['got']:.4g}" + ("" if record["error"] is None else f" ({100.0 * record['error']:+.1f})")
