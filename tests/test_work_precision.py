# SPDX-License-Identifier: GPL-3.0-or-later
"""The work-precision study: fits against curves made of known parts, the journal, the page, and the engines' random numbers."""

import json
import math
import random
import xml.etree.ElementTree as ET
from array import array
from html.parser import HTMLParser
from pathlib import Path

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure import error, render
from true_diffuse.addon.probe import fit
from true_diffuse.scripts.studies.work_precision import curves, page, plot, stability
from true_diffuse.scripts.studies.work_precision.journal import UNITS, Journal

SAMPLES = (1, 4, 16, 64, 256, 1024)


def independent(floor: float, noise: float, slope: float) -> list[float]:
    """Return errors of SAMPLES as the RMS of a fixed part and an independent one."""
    return [math.sqrt(floor**2 + (noise / n**slope) ** 2) for n in SAMPLES]


@pytest.mark.parametrize("floor", [0.0, 0.002, 0.05])
@pytest.mark.parametrize("slope", [0.5, 0.75])
def test_fit_finds_floor_and_slope_of_exact_curves(floor: float, slope: float) -> None:
    found = fit.fit(SAMPLES, independent(floor, 0.4, slope))
    # exact data: what is left is the search's interval and the rounding of the normal equations, whose columns differ by 1e6
    assert found.floor == pytest.approx(floor, rel=1e-4, abs=1e-4)
    assert found.slope == pytest.approx(slope, abs=1e-3) and found.noise == pytest.approx(0.4, rel=1e-3)


def test_fit_of_noisy_repeats_is_right_within_its_uncertainty() -> None:
    """Errors of pictures with 3 x 1000 normal pixels, 20 repeats: means within four of their own standard errors."""
    dice, floor, noise = random.Random(1), 0.01, 0.3
    fits = []
    for _ in range(20):
        errors = []
        for n in SAMPLES:
            squares = math.fsum(dice.gauss(floor, noise / math.sqrt(n)) ** 2 for _ in range(3000))
            errors.append(math.sqrt(squares / 3000))
        fits.append(fit.fit(SAMPLES, errors))
    for values, truth in (([one.floor for one in fits], floor), ([one.slope for one in fits], 0.5)):
        mean = fit.mean(values)
        assert abs(mean.value - truth) < 4.0 * mean.uncertainty


def test_fit_without_noise_has_no_slope() -> None:
    found = fit.fit(SAMPLES, [0.05, 0.0501, 0.0499, 0.05, 0.05, 0.05])
    assert found.floor == pytest.approx(0.05, rel=1e-3) and found.slope is None and found.noise is None
    assert found.samples(0.051) == 1.0 and found.samples(0.049) is None


def test_fit_of_two_counts_tells_no_slope() -> None:
    found = fit.fit((1, 4), (0.2, 0.1))
    assert found.slope is None and found.floor == 0.1  # the floor is at most that


def test_samples_for_a_tolerance_follow_the_curve() -> None:
    # 0.05^2 = 0.03^2 + 0.04^2 and noise 0.4 with slope 1/2: 0.04 = 0.4 / sqrt(100)
    found = fit.Fit(0.03, 0.4, 0.5)
    assert found.samples(0.05) == pytest.approx(100.0)
    assert found.samples(0.03) is None and found.samples(1.0) == 1.0  # at least one


def test_line_has_fixed_and_per_sample_time() -> None:
    found = fit.line(SAMPLES, [0.3 + 0.01 * n for n in SAMPLES])
    assert found.fixed == pytest.approx(0.3) and found.per_sample == pytest.approx(0.01)
    assert fit.line((4,), (2.0,)).seconds(100.0) == 2.0
    falling = fit.line((1, 2), (2.0, 1.0))
    assert falling.per_sample == 0.0 and 1.0 <= falling.fixed <= 2.0
    through = fit.line((1, 10), (0.1, 2.0))  # its intercept would be negative
    assert through.fixed == 0.0 and 0.1 <= through.per_sample <= 0.2


def test_power_law_is_found() -> None:
    found = fit.power(SAMPLES, [0.4 * n**-0.6 for n in SAMPLES])
    assert found.noise == pytest.approx(0.4) and found.slope == pytest.approx(0.6)
    assert fit.power((4,), (0.1,)) == fit.Power(0.2, 0.5)  # independent samples


def test_pareto_front_keeps_what_nothing_beats() -> None:
    points = [(1.0, 0.5), (2.0, 0.2), (2.0, 0.3), (3.0, 0.2), (4.0, 0.1), (1.0, 0.5)]
    assert fit.pareto(points) == [True, True, False, False, True, True]


def unit(label: str, samples: int, repeat: int, seconds: float, wrong: float, **other: object) -> dict[str, object]:
    identity = {"scene": "sphere", "engine": "cycles", "osl": False, "label": label, "kind": "ours", "group": "rough_diffuse"}
    identity |= {"model": "Oren-Nayar", "quality": "Balanced", "sigma": 0.33, "target": "Oren-Nayar", "reference": "analytic"}
    return identity | {"samples": samples, "repeat": repeat, "seconds": seconds, "error": wrong} | other


def two_curves() -> list[dict[str, object]]:
    """Return units of a noisy choice without a floor, and of a fast, wrong one: 1 ms a sample on top of 0.1 s, and 0.05 s."""
    units = []
    for repeat, luck in enumerate((0.9, 1.0, 1.1)):
        for n in (1, 4, 16, 64, 256):
            units.append(unit("Noisy <A&B>", n, repeat, 0.1 + 0.001 * n, luck * 0.2 / math.sqrt(n)))
            units.append(unit("Wrong", n, repeat, 0.05 + 0.001 * n, 0.03, kind="blender", group=None))
    return units


def test_curves_say_what_an_error_costs() -> None:
    first_renders = [
        {"scene": "sphere", "engine": "cycles", "label": "Wrong", "samples": 1, "seconds": 0.551, "build_seconds": 0.2}
    ]
    noisy, wrong = curves.curves(two_curves(), first_renders, {})
    assert [point["samples"] for point in noisy["points"]] == [1, 4, 16, 64, 256]
    first = noisy["points"][0]
    assert (first["error"], first["error_low"], first["error_high"]) == pytest.approx((0.2, 0.18, 0.22))
    assert first["repeats"] == 3 and first["seconds"] == pytest.approx(0.101)
    assert noisy["slope"] == pytest.approx(0.5, abs=1e-3) and noisy["noise"] == pytest.approx(0.2, rel=1e-3)
    # 0.2 / sqrt(n) = 0.02 at n = 100: 0.2 s; 0.005 at n = 1600, beyond the 256 that were measured
    assert noisy["seconds_to"]["0.02"] == pytest.approx(0.2, rel=1e-3) and noisy["beyond"] == ["0.01", "0.005"]
    assert noisy["seconds_to"]["0.005"] == pytest.approx(1.7, rel=1e-2)
    assert wrong["seconds_to"]["0.05"] == pytest.approx(0.051) and wrong["seconds_to"]["0.02"] is None
    assert wrong["build_seconds"] == 0.2 and wrong["first_seconds"] == pytest.approx(0.5) and noisy["first_seconds"] is None
    assert [point["pareto"] for point in wrong["points"]] == [True, False, False, False, False]
    assert [point["pareto"] for point in noisy["points"]] == [False, False, False, True, True]  # 0.2 / 8 is the first below 0.03


def test_error_below_the_references_noise_is_not_promised() -> None:
    noisy, _ = curves.curves(two_curves(), [], {"sphere": 0.03})
    assert noisy["reference_error"] == 0.03 and sorted(noisy["beyond"]) == ["0.005", "0.01", "0.02"]


def test_recommendation_is_the_soonest_measured_choice() -> None:
    found = {one["tolerance"]: one for one in curves.recommendations(curves.curves(two_curves(), [], {}))}
    assert found[0.05]["label"] == "Wrong" and found[0.02]["label"] == "Noisy <A&B>"
    assert found[0.005]["label"] is None and "would take some" in found[0.005]["text"]


def test_journal_goes_on_after_a_damaged_line(tmp_path: Path) -> None:
    journal = Journal(tmp_path, {"machine": 1})
    journal.add(("unit", "sphere", 1), {"seconds": 2.0})
    journal.keep_picture("a", array("f", [1.0, 0.5]))
    path = tmp_path / UNITS
    path.write_text(path.read_text() + '{"key": ["unit", "sphere", 4], "rec')  # a process that was killed while it wrote
    again = Journal(tmp_path, {"machine": 1})
    assert again.is_begun and not again.is_foreign
    assert again.units == {("unit", "sphere", 1): {"seconds": 2.0}} and list(again.picture("a")) == [1.0, 0.5]
    again.add(("unit", "sphere", 4), {"seconds": 3.0})
    assert [one["seconds"] for one in Journal(tmp_path, {"machine": 1}).of("unit")] == [2.0, 3.0]


def test_journal_of_another_study_is_begun_anew(tmp_path: Path) -> None:
    folder = tmp_path / "journal"
    Journal(folder, {"machine": 1}).add(("unit", 1), {"seconds": 2.0})
    other = Journal(folder, {"machine": 2})
    assert other.is_foreign and not other.is_begun and not other.units
    other.remove()
    assert list(tmp_path.iterdir()) == []


class Tags(HTMLParser):
    """Checks that every tag is closed in order; collects attributes and text."""

    EMPTY = {"meta"}

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += attrs
        if tag not in self.EMPTY:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.attributes += attrs

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text.append(data)


def document() -> dict[str, object]:
    found = curves.curves(two_curves(), [], {})
    return {
        "environment": {
            "machine": {"system": "a system", "processor": "a processor", "cores": 2},
            "devices": {"cycles": "CPU"},
            "blender": "5.2",
            "true_diffuse": "0",
        },
        "options": {"quick": True, "engines": ["cycles"], "scenes": ["sphere"]},
        "scenes": [{"scene": "sphere", "seconds": 0.1, "reference": "a <formula>"}],
        "curves": found,
        "startup": [{"engine": "cycles", "seconds": 0.5}],
        "stability": list(stability.records()),
        "hard_inputs": [],
        "claims": [{"claim": "a < b", "measured": ["1 < 2"], "verdict": "True"}],
        "recommendations": curves.recommendations(found),
    }


def test_page_is_whole_and_needs_nothing_else() -> None:
    text = page.html(document())
    tags = Tags()
    tags.feed(text)
    assert tags.open == []
    assert ("name", "viewport") in tags.attributes
    assert not {"src", "href", "xlink:href"} & {name for name, _ in tags.attributes}
    assert "http" not in text and "@import" not in text and "url(" not in text and "<script" not in text
    shown = "".join(tags.text)
    assert "Noisy <A&B>" in shown and "<A&B>" not in text and "a <formula>" in shown


def test_plot_shows_every_curve_inside_its_frame() -> None:
    found = curves.curves(two_curves(), [], {"sphere": 0.004})
    root = ET.fromstring(plot.svg(found, "a < b"))
    groups = [one for one in root.iter("g") if one.get("class") == "curve"]
    assert [one.find("title").text for one in groups] == ["Noisy <A&B>", "Wrong"]
    for group, curve in zip(groups, found, strict=True):
        places = [tuple(map(float, place.split(","))) for place in group.find("polyline").get("points").split()]
        assert len(places) == len(curve["points"])
        assert all(plot.LEFT <= x <= plot.WIDTH - plot.RIGHT and plot.TOP <= y <= plot.HEIGHT - plot.BOTTOM for x, y in places)
        assert [x for x, _ in places] == sorted(x for x, _ in places)  # to the right: longer
        rings = sum(one.get("class") == "pareto" for one in group.iter("circle"))
        assert rings == sum(point["pareto"] for point in curve["points"])
    looks = {plot.style(index) for index in range(20)}
    assert len(looks) == 20


def test_equation_as_printed_breaks_where_ours_does_not() -> None:
    rows = {one["case"]: one for one in stability.records() if one["what"].startswith("Equation")}
    assert rows["N = L = E"]["plain"] == "0 / 0" and rows["sigma NaN"]["plain"] == "nan"
    # A / pi at sigma 0.3, where s = 0: A = 1 - 0.5 * 0.09 / 0.42
    assert rows["N = L = E"]["ours"] == pytest.approx((1.0 - 0.045 / 0.42) / math.pi)
    assert rows["N.E 0.05"]["plain"] == pytest.approx(1.85, abs=0.01) and rows["N.E 0.05"]["ours"] < 1.02
    assert all(isinstance(one["ours"], float) and 0.0 <= one["ours"] < 1.02 for one in rows.values())
    json.dumps(list(rows.values()), allow_nan=False)


def shaded_floor() -> tuple[bpy.types.Object, bpy.types.Object]:
    """Return a floor half below a plate, and a wide lamp above: its shadow has a wide edge."""
    scene = bpy.context.scene
    mesh = bpy.data.meshes.new("Floor and Plate")
    floor, plate = ((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)), ((-1, -1, 0.5), (0, -1, 0.5), (0, 1, 0.5), (-1, 1, 0.5))
    mesh.from_pydata([*floor, *plate], [], [(0, 1, 2, 3), (4, 5, 6, 7)])
    mesh.materials.append(materials.create_plain("Plain")[0])
    body = bpy.data.objects.new("Floor and Plate", mesh)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 3.0, (0.0, 0.0, 5.0)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.energy, lamp.data.size, lamp.location = 100.0, 2.0, (0.0, 0.0, 3.0)
    for item in (body, camera, lamp):
        scene.collection.objects.link(item)
    scene.camera = camera
    scene.render.resolution_x = scene.render.resolution_y = 24
    scene.view_layers[0].update()
    return body, lamp


@pytest.mark.slow
@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_seed_changes_noise_alone(engine: engines.Engine) -> None:
    body, lamp = shaded_floor()
    difference = {}
    for shadows in (False, True):
        if engine is engines.CYCLES and not shadows:
            lamp.data.type, lamp.data.energy = "SUN", 1.0  # of no width in a measurement, so that there is no noise
        elif engine is engines.CYCLES:
            lamp.data.type, lamp.data.energy, lamp.data.size = "AREA", 100.0, 2.0
        with render.measurement_scene(bpy.context.scene, body, lamp, shadows=shadows) as scene:
            first, same, other = (render.radiance(scene, engine, 2, seed)[1] for seed in (0, 0, 2))
            assert len(other) == len(first) == 3 * render.cropped(scene).width * render.cropped(scene).height
        assert same == first
        difference[shadows] = error.difference(other, first, range(len(first) // 3))
    # without shadows: colors of 10 bits, and Cycles' filter of 0.01 pixels; a shadow's edge of 2 samples is noise
    assert difference[False] < 0.004 < 0.01 < difference[True]


@pytest.mark.usefixtures("empty_file")
def test_seed_without_room_is_refused() -> None:
    body, lamp = shaded_floor()
    with (
        render.measurement_scene(bpy.context.scene, body, lamp) as scene,
        pytest.raises(ValueError, match="a seed of 9 needs 9 pixels of the frame"),
    ):
        render.radiance(scene, engines.EEVEE, 1, 9)
