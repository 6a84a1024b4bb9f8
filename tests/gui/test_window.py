# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension in a real Blender window, clicked through: `uv run pytest -m gui`. Look at the pictures it leaves in build/gui.

The environment variable BLENDER is the command that starts Blender 5.2 in an X display with xdotool and ImageMagick's import, as
`BLENDER='xvfb-run -a -s "-screen 0 1600x1000x24" blender'`.
"""

import os
import shlex
import shutil
import subprocess
from pathlib import Path

import pytest

from true_diffuse.scripts.release.package import build

pytestmark = pytest.mark.gui

ROOT = Path(__file__).resolve().parents[2]
PICTURES = ROOT / "build" / "gui"
STEPS = (
    "installed",
    "add_menu",
    "group_added",
    "panel",
    "cycles",
    "eevee",
    "realtime",
    "realtime_orbited",
    "realtime_rendered",
    "context_menu",
    "converted",
    "preferences",
    "dragged",
    "dropped",
    "characters",
    "characters_converted",
    "characters_rough",
    "not_carried",
    "gltf_options",
    "reverted",
    "measured",
    "edited",
    "reopened",
)


@pytest.fixture(scope="module")
def blender() -> list[str]:
    command = shlex.split(os.environ.get("BLENDER", ""))
    if not command or shutil.which(command[0]) is None:
        pytest.skip("the environment variable BLENDER names no command that starts Blender in a display")
    return command


def test_window_is_clicked_through(blender: list[str]) -> None:
    shutil.rmtree(PICTURES / "walk", ignore_errors=True)
    folder = PICTURES / "walk"
    folder.mkdir(parents=True)
    package = build(folder)
    walk = Path(__file__).with_name("walk.py")
    options = ["--factory-startup", "--window-geometry", "0", "0", "1600", "1000", "--python", str(walk)]
    result = subprocess.run(
        [*blender, *options, "--", str(package), str(folder)], capture_output=True, text=True, timeout=900, check=False
    )
    log = (folder / "log.txt").read_text(encoding="utf-8") if (folder / "log.txt").exists() else result.stdout + result.stderr
    assert "walked to the end" in log, log
    assert [step for step in STEPS if not (folder / f"{step}.png").is_file()] == []
