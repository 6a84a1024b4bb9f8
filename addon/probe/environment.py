# SPDX-License-Identifier: GPL-3.0-or-later
"""The machine and versions that measured figures depend on."""

import os
import platform
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import bpy

from ..blender import engines
from ..blender.engines import Engine

MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"


def environment(used: Sequence[Engine]) -> dict[str, object]:
    """Return the machine, the versions, and the device of each of the `used` engines, as JSON values."""
    return {
        "machine": {
            "system": f"{platform.system()} {platform.machine()}",
            "processor": platform.processor() or platform.machine(),
            "cores": os.cpu_count(),
        },
        "true_diffuse": tomllib.loads(MANIFEST.read_text(encoding="utf-8"))["version"],
        "system_version": platform.platform(),  # apart from "machine", which is compared: this changes with every update
        "blender": bpy.app.version_string,
        "blender_build": bpy.app.build_hash.decode(errors="replace"),
        "python": platform.python_version(),
        "devices": {engine.key: engines.device(engine) for engine in used},
    }


def merged(environments: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the first of `environments` with the devices of all, and a list of all different ones; empty where all agree."""
    devices: dict[str, str] = {}
    machines: list[dict[str, Any]] = []
    for environment in environments:
        devices |= environment["devices"]
        machine = {name: value for name, value in environment.items() if name != "devices"}
        if machine not in machines:
            machines.append(machine)
    return machines[0] | {"devices": devices}, machines if len(machines) > 1 else []
