# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine and versions that measured figures depend on."""

import os
import platform
from collections.abc import Sequence

import bpy

from ..blender import engines
from ..blender.engines import Engine
from ..blender.extension import version


def environment(used: Sequence[Engine]) -> dict[str, object]:
    """Return the machine, the versions, and the device of each of the `used` engines, as JSON values."""
    return {
        "machine": {
            "system": f"{platform.system()} {platform.machine()}",
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
        },
        "true_diffuse": version(),
        "system_version": platform.platform(),  # apart from "machine", which is compared: this changes with every update
        "blender": bpy.app.version_string,
        "blender_build": bpy.app.build_hash.decode(errors="replace"),
        "python": platform.python_version(),
        "devices": {engine.key: engines.device(engine) for engine in used},
    }
