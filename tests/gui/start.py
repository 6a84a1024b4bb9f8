# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs inside Blender: installs the package and takes the walk that the command line names."""

import importlib
import sys
import traceback
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).resolve().parent))

import window  # ty: ignore[unresolved-import] - beside this file

name = sys.argv[sys.argv.index("--") + 1]


def walk() -> window.Steps:
    yield from window.install()
    yield from importlib.import_module(f"walks.{name}").walk()
    window.say("walked to the end")


steps = walk()


def tick() -> float | None:
    """Do the next step; whatever goes wrong ends Blender, with the reason in the log."""
    try:
        return next(steps)
    except StopIteration:
        pass
    except Exception:
        window.say(traceback.format_exc())
        window.picture("failed")
    bpy.ops.wm.quit_blender()
    return None


bpy.context.preferences.view.show_splash = False
bpy.app.timers.register(tick, first_interval=3.0, persistent=True)
