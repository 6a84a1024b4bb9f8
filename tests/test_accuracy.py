# SPDX-License-Identifier: GPL-3.0-or-later
"""The command line scripts/accuracy.py as its users run it."""

import json
from pathlib import Path

import pytest

from support import run_script


@pytest.mark.render
def test_accuracy_end_to_end(tmp_path: Path) -> None:
    options = "--only rough --quick --engine cycles --out records/accuracy.json"
    result = run_script("accuracy.py", *options.split(), cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    document = json.loads((tmp_path / "records" / "accuracy.json").read_text())
    records = document["records"]
    assert len(records) == 4 * 3  # ways in Cycles, angles
    fields = "target engine quality model sigma light_degrees samples rms_error lobe_error render_seconds"
    assert all(set(record) == set(fields.split()) for record in records)
    for record in records:
        if record["quality"] == "Balanced" and record["target"] == "nodes" and record["light_degrees"] <= 60.0:
            # the sphere's front: no more than the lobes' own error over all lights
            assert record["rms_error"] < record["lobe_error"]


def test_accuracy_refuses_a_folder_in_one_line(tmp_path: Path) -> None:
    result = run_script("accuracy.py", "--out", ".", cwd=tmp_path)
    assert (result.returncode, result.stderr) == (2, "accuracy.py: error: . is a folder\n")
