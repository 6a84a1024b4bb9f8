# SPDX-License-Identifier: GPL-3.0-or-later
"""What figures depend on besides the options."""

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


def merged(environments: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the first of `environments` with the devices of all, and where machines differ all of them, each once."""
    devices: dict[str, str] = {}
    machines: list[dict[str, Any]] = []
    for one in environments:
        devices |= one["devices"]
        machine = {name: value for name, value in one.items() if name != "devices"}
        if machine not in machines:
            machines.append(machine)
    return machines[0] | {"devices": devices}, machines if len(machines) > 1 else []
