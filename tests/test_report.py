# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line scripts/report.py as its users run it: a process of its own, killed half-way and started again."""

import csv
import json
import os
import signal
import subprocess
import sys
from functools import partial
from pathlib import Path

import pytest

from support import SCRIPTS, assert_bad_input, run_script, wait_for
from true_diffuse.addon.probe.tolerance import choose

SPHERE = ("--engine", "cycles", "--scene", "sphere", "--quick", "--out", "out")
UNITS = Path("out", ".journal_quick", "units.jsonl")
ENOUGH = 12  # lines of a journal, of some sixty


report = partial(run_script, "report.py")


@pytest.mark.render
@pytest.mark.skipif(os.name != "posix", reason="Windows has no such signals")
def test_killed_study_goes_on_from_what_it_has(tmp_path: Path) -> None:
    command, journal = [sys.executable, SCRIPTS / "report.py", *SPHERE], tmp_path / UNITS
    process = subprocess.Popen(command, cwd=tmp_path, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: journal.exists() and journal.read_bytes().count(b"\n") >= ENOUGH)
    process.send_signal(signal.SIGTERM)
    _, said = process.communicate(timeout=20)
    assert process.returncode == 128 + signal.SIGTERM and "run it again to go on" in said
    assert [path.name for path in (tmp_path / "out").iterdir()] == [".journal_quick"]  # nothing half-written beside it
    # what was measured gets a mark: were it measured again, the mark would be gone
    header, *lines = [json.loads(line) for line in journal.read_text().splitlines()]
    done = [line for line in lines if line["key"][0] == "unit"]
    for line in done:
        line["record"]["seconds"] = 1234.0
    journal.write_text("".join(json.dumps(line) + "\n" for line in (header, *lines)) + '{"key": ["unit", "sph')

    result = report(*SPHERE, cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert f"Going on from {len(lines)} results" in result.stdout
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["index.html", "report.csv", "report.json"]
    document = json.loads((tmp_path / "out" / "report.json").read_text())
    curves = document["curves"]
    high = [point["seconds_high"] for curve in curves for point in curve["points"]]
    assert len(done) >= 1 and 1 <= high.count(1234.0) <= len(done)
    assert high.count(1234.0) >= len({tuple(line["key"][:5]) for line in done})  # all of them, repeats of one point together

    assert document["version"] == 2 and document["options"] == {"quick": True, "engines": ["cycles"], "scenes": ["sphere"]}
    labels = {curve["label"] for curve in curves}
    ours = {"Rough Diffuse, Balanced", "Rough Diffuse, Exact for Chosen Lights"}
    assert ours | {"Diffuse BSDF", "Principled BSDF", "Lambert"} <= labels
    floors = {curve["label"].removeprefix("Rough Diffuse, "): curve["floor"] for curve in curves}
    # chosen lights are exact but for the pixel filter; lobes are within 1 %; Lambert is off by the model's whole effect
    assert floors["Exact for Chosen Lights"] < 0.001 < floors["Balanced"] < 0.01 < 0.1 < floors["Lambert"]
    for curve in curves:
        assert curve["reference"] == "analytic" and curve["reference_error"] == 0.0 and curve["slope"] is None
        assert [point["samples"] for point in curve["points"]] == [1, 4, 16, 64]
        assert all(point["repeats"] == 2 and point["seconds"] > 0.0 for point in curve["points"])
    rows = list(csv.DictReader((tmp_path / "out" / "report.csv").read_text().splitlines()))
    assert len(rows) == sum(len(curve["points"]) for curve in curves)
    page = (tmp_path / "out" / "index.html").read_text()
    assert all(page.count(label) >= 2 for label in labels)  # in the diagram and in the table


@pytest.mark.slow
def test_realtime_is_a_variant_and_can_be_picked(tmp_path: Path, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("Realtime finds no graphics driver here")
    result = report("--engine", "realtime", "--scene", "sphere,furnace", "--quick", "--out", "out", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    document = json.loads((tmp_path / "out" / "report.json").read_text())
    curves = {(curve["scene"], curve["label"]): curve for curve in document["curves"]}
    assert {label for _, label in curves} == {"Rough Diffuse", "Diffuse BSDF (Lambert)"}
    assert curves["sphere", "Rough Diffuse"]["floor"] <= 1e-4  # as in test_engines
    assert curves["furnace", "Rough Diffuse"]["floor"] <= 1e-3  # a fit of the albedo, and of what it is held against
    assert curves["sphere", "Diffuse BSDF (Lambert)"]["floor"] > 0.1  # Lambert is 12.8 % from the model
    assert {one["label"] for one in document["recommendations"] if one["scene"] == "sphere"} == {"Rough Diffuse"}
    choice = choose(document, "sphere", "realtime", "Oren-Nayar", 0.001, roughness=0.33)
    assert (choice.quality, choice.samples, choice.variant) == (None, 1, "GLSL")


@pytest.mark.parametrize(
    "arguments",
    [
        ("--engine", "glsl"),
        ("--scene", "theater"),
        ("--scene", ""),
        ("--out", "a_file"),
        ("--out", "a_file/below"),
        ("--samples", "4"),
    ],
    ids=" ".join,
)
def test_bad_options_are_one_line_and_status_2(arguments: tuple[str, ...], tmp_path: Path) -> None:
    (tmp_path / "a_file").touch()
    result = report("--quick", *arguments, cwd=tmp_path)
    assert_bad_input(result, "report.py: error: ")
    assert [path.name for path in tmp_path.iterdir()] == ["a_file"]
