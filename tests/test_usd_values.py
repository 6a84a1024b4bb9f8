# SPDX-License-Identifier: GPL-3.0-or-later
"""What feeds an input, as MaterialX computes it: the GLSL that MaterialX's own library generates, against the reference."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"
# in a process of its own, as Blender's copy of MaterialX, which other tests import, is not the package's
MEASURE = """
import json, sys
sys.path.insert(0, sys.argv[1])
import checkout
import moderngl
from true_diffuse.scripts.studies import materialx_values
try:
    print(json.dumps(materialx_values.errors()))
except moderngl.Error as error:
    print(json.dumps(str(error)))
"""


def test_operations_have_the_value_of_the_reference() -> None:
    result = subprocess.run([sys.executable, "-c", MEASURE, str(SCRIPTS)], capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout.splitlines()[-1])  # drivers may print, too
    if isinstance(found, str):
        pytest.skip(f"no graphics driver runs the GLSL that MaterialX generates: {found}")
    assert len(found) > 65
    assert {name: error for name, error in found.items() if error > 1e-4} == {}
