# SPDX-License-Identifier: GPL-3.0-or-later
"""What figures depend on besides the options."""

import os
import platform
import tomllib
from collections.abc import Sequence
from pathlib import Path

import bpy

from .. import engines
from ..engines import Engine

MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"


def environment(used: Sequence[Engine]) -> dict[str, object]:
    """Return what the figures depend on besides the options: machine, Blender, devices, versions."""
    return {
        "machine": {
            "system": f"{platform.system()} {platform.machine()}",
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
        },
        "true_diffuse": tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"],
        "system_version": platform.platform(),  # not of the machine's identity: it changes with every update
        "blender": bpy.app.version_string,
        "blender_build": bpy.app.build_hash.decode(errors="replace"),
        "python": platform.python_version(),
        "devices": {engine.key: engines.device(engine) for engine in used},
    }
