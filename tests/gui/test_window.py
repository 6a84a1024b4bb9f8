# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real Blender window, clicked through: `uv run pytest -m gui`. Look at the pictures that are left in build/gui.

Each file of tests/gui/walks is a walk of its own; `-k NAME` takes one. The environment variable BLENDER is the command that starts
Blender 5.2 in an X display with xdotool and ImageMagick's import, as `BLENDER='xvfb-run -a -s "-screen 0 1600x1000x24" blender'`.
"""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from true_diffuse.scripts.release.package import build

pytestmark = pytest.mark.gui

HERE = Path(__file__).resolve().parent
PICTURES = HERE.parents[1] / "build" / "gui"
WALKS = sorted(path.stem for path in (HERE / "walks").glob("*.py"))


@pytest.fixture(scope="module")
def blender() -> list[str]:
    command = shlex.split(os.environ.get("BLENDER", ""))
    if not command or shutil.which(command[0]) is None:
        pytest.skip("the environment variable BLENDER names no command that starts Blender in a display")
    return command


@pytest.mark.parametrize("walk", WALKS)
def test_window_is_clicked_through(blender: list[str], walk: str) -> None:
    folder = PICTURES / walk
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    package = build(folder)
    options = ["--factory-startup", "--window-geometry", "0", "0", "1600", "1000", "--python", str(HERE / "start.py")]
    result = subprocess.run(
        [*blender, *options, "--", walk, str(package), str(folder)], capture_output=True, text=True, timeout=900, check=False
    )
    log = (folder / "log.txt").read_text(encoding="utf-8") if (folder / "log.txt").exists() else result.stdout + result.stderr
    assert "walked to the end" in log, log
