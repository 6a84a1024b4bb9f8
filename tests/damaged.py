# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads and renders the files that it is told of, one line of JSON in, one out; for test_damaged_files, which starts it.

What compare.py does, without starting Blender for each file: whoever reads finds out by what ends this process what would end that.
"""

import json
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent / "scripts"))

import bpy

import checkout  # noqa: F401
from true_diffuse.addon.blender.engines import CYCLES
from true_diffuse.scripts.characters import reading
from true_diffuse.scripts.cli.console import Progress
from true_diffuse.scripts.studies.comparison import five
from true_diffuse.scripts.studies.comparison.outcomes import Outcomes, WorkError


def outcome(path: str) -> str:
    """Return "picture", or the line that the user would get."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    asked = {"engines": ("cycles",), "samples": {"cycles": 1}, "resolution": (64, 24), "sigmas": (0.2,)}
    rest = {"albedo": 0.8, "full_figure": False, "plaster": False, "configurations": {}}
    spec = five.JobSpec(characters={"damaged": path}, **asked, **rest)
    renderer, outcomes = five.Renderer(spec, [CYCLES]), Outcomes()
    progress = Progress(1000.0, lambda *_: None)
    try:
        for chunk in spec.chunks():
            renderer.do(chunk, outcomes, progress)
    except WorkError as error:
        return str(error)
    return "picture"


def main() -> None:
    """Answer until there is no more to read."""
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    quiet = os.open(os.devnull, os.O_WRONLY)
    os.dup2(quiet, 1)
    os.dup2(quiet, 2)
    reading.supervised(Path(sys.argv[1]))
    reading.SECONDS = int(sys.argv[2])
    for line in sys.stdin:
        answers.write(json.dumps(outcome(json.loads(line))) + "\n")


if __name__ == "__main__":
    main()
