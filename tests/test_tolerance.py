# SPDX-License-Identifier: GPL-3.0-or-later
"""The choice of quality and samples from a made-up report, for which the fastest choice follows by hand."""

import json
import math
import subprocess
from argparse import ArgumentTypeError
from pathlib import Path
from typing import Any

import pytest

from support import run_script
from true_diffuse.addon.probe.environment import environment
from true_diffuse.addon.probe.tolerance import ToleranceError, choose, describe, read_report
from true_diffuse.scripts.cli.inputs import percentage

HERE = {"machine": {"cores": 2}, "blender": "5.2.3"}


def curve(quality: str, floor: float, noise: float | None, fixed: float, per_sample: float, **other: Any) -> dict[str, Any]:
    """error(n)^2 = floor^2 + (noise / sqrt(n))^2, or the floor alone; measured at 1, 16 and 256 samples."""
    points = []
    for n in (1, 16, 256):
        error = math.hypot(floor, (noise or 0.0) / math.sqrt(n))
        points.append({"samples": n, "error": error, "error_low": error, "error_high": error, "seconds": fixed + n * per_sample})
    return {
        "scene": "five",
        "engine": "cycles",
        "osl": False,
        "kind": "ours",
        "group": "rough_diffuse",
        "model": "Oren-Nayar",
        "quality": quality,
        "sigma": 0.33,
        "points": points,
        "floor": floor,
        "floor_uncertainty": 0.0,
        "slope": None if noise is None else 0.5,
        "noise": noise,
        "seconds_fixed": fixed,
        "seconds_per_sample": per_sample,
    } | other


def report(*curves: dict[str, Any]) -> dict[str, Any]:
    return {"version": 2, "environment": HERE, "curves": list(curves)}


NOISY = curve("Balanced", 0.01, 0.2, 1.0, 0.1)
SLOW = curve("Precise", 0.001, 0.2, 1.0, 0.5)


def test_choice_has_the_fewest_samples_of_the_fastest_quality() -> None:
    # 0.0301^2 = 0.01^2 + 0.2^2 / n: n = 0.04 / 0.000806 = 49.6, in 1 + 5 s; Precise: n = 44.2, in 23.5 s
    choice = choose(report(NOISY, SLOW), "five", "cycles", "Oren-Nayar", 0.0301)
    assert (choice.quality, choice.samples) == ("Balanced", 50)
    assert choice.seconds == pytest.approx(6.0) and choice.expected_error == pytest.approx(0.03)


def test_choice_is_slower_below_the_floor_of_the_fast_quality() -> None:
    # 0.2 / sqrt(n) <= sqrt(0.0135^2 - 0.001^2) from n = 221 on; Balanced, whose floor is 1 %, would take 487
    choice = choose(report(NOISY, SLOW), "five", "cycles", "Oren-Nayar", 0.0135)
    assert (choice.quality, choice.samples) == ("Precise", math.ceil(0.04 / (0.0135**2 - 0.001**2)))


def test_no_more_samples_than_were_measured() -> None:
    # 256 samples have sqrt(0.01^2 + 0.2^2 / 256) = 1.6008 %
    assert choose(report(NOISY), "five", "cycles", "Oren-Nayar", 0.01601).samples == 256
    with pytest.raises(ToleranceError, match=r"Cycles reaches 1\.6 % at best, with Balanced and 256 samples, not 1\.6 %"):
        choose(report(NOISY), "five", "cycles", "Oren-Nayar", 0.016)


def test_benchmark_continues_its_noise_as_independent_samples_do() -> None:
    """0.2 n^-0.75 up to 16 samples, 0.025 there; then 0.025 sqrt(16 / n)."""
    steep = curve("Balanced", 0.0, 0.2, 1.0, 0.1) | {"slope": 0.75, "last_samples": 1000}
    steep["points"] = steep["points"][:2]
    case = report(steep), "five", "cycles", "Oren-Nayar"
    assert choose(*case, 0.05).samples == math.ceil(4.0 ** (4.0 / 3.0))
    assert choose(*case, 0.0101).samples == math.ceil(16.0 * (0.025 / 0.0101) ** 2)
    assert choose(*case, 0.0101).expected_error == pytest.approx(0.0101, rel=0.01)
    with pytest.raises(ToleranceError, match="with Balanced and 1000 samples"):  # 0.32 %
        choose(*case, 0.003)
    flat = curve("Balanced", 0.0, 0.2, 1.0, 0.1) | {"slope": 0.25, "last_samples": 1000}
    # 0.2 n^-0.25 falls no faster beyond 256 samples, where it is 0.05
    assert choose(report(flat), *case[1:], 0.0401).samples == math.ceil((0.2 / 0.0401) ** 4)


def test_uncertainty_counts_against_a_quality() -> None:
    sure = curve("Balanced", 0.02, None, 1.0, 0.1)
    unsure = sure | {"floor_uncertainty": 0.02}
    assert choose(report(sure), "five", "cycles", "Oren-Nayar", 0.03).samples == 1
    with pytest.raises(ToleranceError):
        choose(report(unsure), "five", "cycles", "Oren-Nayar", 0.03)
    fitted = NOISY | {"floor_uncertainty": 0.005}  # n = 0.04 / (0.03^2 - 0.015^2) = 59.3
    assert choose(report(fitted), "five", "cycles", "Oren-Nayar", 0.03).samples == 60


def test_error_is_that_of_the_sphere_with_the_noise_of_the_scene() -> None:
    # in the scene both differ 9 % from another engine, whatever the quality; from the model they differ 3 % and 0.5 %
    curves = [curve(quality, 0.09, None, seconds, 0.1) for quality, seconds in (("Balanced", 1.0), ("Precise", 3.0))]
    curves += [curve(quality, floor, None, 1.0, 0.1, scene="sphere") for quality, floor in (("Balanced", 0.03), ("Precise", 0.005))]
    assert choose(report(*curves), "five", "cycles", "Oren-Nayar", 0.04).quality == "Balanced"
    choice = choose(report(*curves), "five", "cycles", "Oren-Nayar", 0.02)
    assert (choice.quality, choice.expected_error) == ("Precise", 0.005) and choice.seconds == pytest.approx(3.1)
    # noise that shows at one sample alone: 0.0906^2 = 0.09^2 + 0.0104^2, so 0.0115 with the 0.5 % of Precise
    noisy = curves[1] | {"points": [{**point, "error": 0.0906 if point["samples"] == 1 else 0.09} for point in curves[1]["points"]]}
    assert choose(report(noisy, *curves[2:]), "five", "cycles", "Oren-Nayar", 0.0116).samples == 1
    assert choose(report(noisy, *curves[2:]), "five", "cycles", "Oren-Nayar", 0.0114).samples == 16


def test_qualities_can_be_excluded_and_osl_demanded() -> None:
    exact, osl = curve("Exact for Chosen Lights", 0.001, None, 0.1, 0.1), curve("Balanced", 0.001, None, 0.5, 0.1, osl=True)
    case = report(NOISY, exact, osl), "five", "cycles", "Oren-Nayar", 0.03
    assert choose(*case).quality == "Exact for Chosen Lights"
    assert choose(*case, excluded={"Exact for Chosen Lights"}).osl
    assert not choose(*case, osl=False, excluded={"Exact for Chosen Lights"}).osl


SMOOTH, ROUGH = curve("Balanced", 0.01, None, 1.0, 0.1, sigma=0.2), curve("Balanced", 0.02, None, 1.0, 0.1, sigma=0.33)


@pytest.mark.parametrize(("sigma", "expected"), [(0.0, 0.01), (0.2, 0.01), (0.21, 0.02), (0.33, 0.02)])
def test_roughness_is_looked_up_where_the_error_is_not_smaller(sigma: float, expected: float) -> None:
    assert choose(report(SMOOTH, ROUGH), "five", "cycles", "Oren-Nayar", 0.05, sigma).expected_error == expected


def test_roughness_above_all_that_were_measured_raises() -> None:
    with pytest.raises(ToleranceError, match=r"up to a roughness of 0\.33, not 0\.5"):
        choose(report(SMOOTH, ROUGH), "five", "cycles", "Oren-Nayar", 0.05, 0.5)


def test_unmeasured_model_raises_and_names_the_measured_ones() -> None:
    principled = curve("", 0.0, None, 0.0, 0.0, kind="blender", model="Principled")
    with pytest.raises(ToleranceError, match=r"has no Fujii in Cycles, scene five: it has Oren-Nayar$"):
        choose(report(NOISY, principled), "five", "cycles", "Fujii", 0.05)
    with pytest.raises(ToleranceError, match="has no Oren-Nayar in EEVEE"):
        choose(report(NOISY), "five", "eevee", "Oren-Nayar", 0.05)


def test_engine_without_qualities_gets_a_sample_count() -> None:
    realtime = curve("", 1e-5, 0.02, 0.1, 0.01, engine="realtime") | {"quality": None}
    # 0.02 / sqrt(n) <= sqrt(0.005^2 - 1e-10) from n = 16 + 6e-5 on
    choice = choose(report(NOISY, realtime), "five", "realtime", "Oren-Nayar", 0.005)
    assert (choice.quality, choice.samples) == (None, 17)
    assert describe(choice).startswith("Realtime: GLSL with 17 samples, 0.49 % expected")
    with pytest.raises(ToleranceError, match="has no Oren-Nayar in Realtime"):
        choose(report(NOISY), "five", "realtime", "Oren-Nayar", 0.05)


def test_report_of_this_environment_is_read(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    path.write_text(json.dumps(report(NOISY)))
    assert read_report(path, HERE)["curves"] == [NOISY]


@pytest.mark.parametrize(
    ("text", "environment", "message"),
    [
        (None, HERE, r"no report at .*: run scripts/report\.py"),
        (json.dumps(report(NOISY)), HERE | {"machine": {"cores": 4}}, "another machine"),
        (json.dumps(report(NOISY)), HERE | {"blender": "5.2.4"}, r"Blender 5\.2\.3, this is 5\.2\.4"),
        ("", HERE, "cannot be read"),
        ("{", HERE, "cannot be read"),
        ("[]", HERE, "no report of this version"),
        ('{"version": 1, "curves": [1]}', HERE, "no report of this version"),
    ],
)
def test_unusable_report_raises(text: str | None, environment: dict[str, Any], message: str, tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    if text is not None:
        path.write_text(text)
    with pytest.raises(ToleranceError, match=message):
        read_report(path, environment)


@pytest.mark.parametrize("text", ["2%", "2 %", " 2", "2.0"])
def test_percent_is_read_with_and_without_its_sign(text: str) -> None:
    assert percentage(text) == 0.02


@pytest.mark.parametrize("text", ["0", "-1 %", "101", "nan", "two", "", "%"])
def test_percent_is_a_number_above_0(text: str) -> None:
    with pytest.raises(ArgumentTypeError):
        percentage(text)


def compare(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    options = "--engine cycles --character monkey --resolution 160x60"
    return run_script("compare.py", *options.split(), *arguments, cwd=folder)


@pytest.mark.render
def test_comparison_by_tolerance(tmp_path: Path) -> None:
    (tmp_path / "report.json").write_text(json.dumps(report(NOISY) | {"environment": environment([])}))
    result = compare(tmp_path, "--error", "3.01%", "--report", "report.json", "--out", "out")
    assert result.returncode == 0, result.stderr
    assert "For 3 % Cycles: Balanced with 50 samples, 3 % expected in 6 s" in result.stdout
    document = json.loads((tmp_path / "out" / "compare.json").read_text())
    assert {record["samples"] for record in document["records"]} == {50}
    picked = document["choices"]["cycles"]
    assert (picked["quality"], picked["samples"], picked["met"]) == ("Balanced", 50, True)
    rough = [record["rms_error"] for record in document["records"] if record["name"] != "specular"]
    assert picked["measured_error"] == max(rough)


@pytest.mark.parametrize(
    ("options", "why"),
    [
        ("--error 2% --samples 4", "leave out --samples"),
        ("--error 2% --scene face", "--scene face has no option --error"),
        ("--error 0", "not a percentage above 0"),
        ("--error 2%", "run scripts/report.py"),
    ],
)
def test_comparison_by_tolerance_fails_with_one_line(tmp_path: Path, options: str, why: str) -> None:
    result = compare(tmp_path, *options.split())
    assert result.returncode == 2 and why in result.stderr and len(result.stderr.splitlines()) == 1
    assert list(tmp_path.iterdir()) == []
