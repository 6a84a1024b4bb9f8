# SPDX-License-Identifier: GPL-3.0-or-later
"""Khronos' glTF validator, run by node."""

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from pathlib import Path

from true_diffuse.scripts.web import WebError
from true_diffuse.scripts.web.packages import KHRONOS, node_modules

SCRIPT = KHRONOS.with_name("validate.cjs")


class Severity(IntEnum):
    """How bad a message is; the validator's own numbers."""

    ERROR = 0
    WARNING = 1
    INFORMATION = 2
    HINT = 3


@dataclass(frozen=True)
class Message:
    """What the validator says: of what severity, the code of its kind, where in the file's JSON, and in words."""

    severity: Severity
    code: str
    pointer: str
    text: str


def messages(files: Sequence[Path]) -> list[list[Message]]:
    """Return what the validator says of each of `files`, .glb or .gltf. Raises WebError where node or the package cannot be had."""
    node = shutil.which("node")
    if node is None:
        raise WebError("node is not installed, which runs Khronos' validator")
    environment = os.environ | {"NODE_PATH": str(node_modules(KHRONOS))}
    result = subprocess.run([node, SCRIPT, *files], capture_output=True, text=True, check=False, env=environment)
    if result.returncode:
        raise WebError(f"Khronos' validator fails: {' '.join(result.stderr.split())}")
    return [
        [Message(Severity(one["severity"]), one["code"], one.get("pointer", ""), one["message"]) for one in found]
        for found in json.loads(result.stdout)
    ]
