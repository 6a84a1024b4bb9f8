# SPDX-License-Identifier: GPL-3.0-or-later
"""What several test files need: models with usual inputs, scripts run as users do, a progress that counts, a layout for panels."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import bpy

import pytest

from true_diffuse.addon.blender import engines
from true_diffuse.addon.blender.id_properties import BUILT_FINGERPRINT, SPECIALIZED_FOR
from true_diffuse.addon.measure import render
from true_diffuse.addon.models import MODELS, Formula

USUAL = {"Roughness": 0.5, "IOR": 1.5}
"""Inputs of a node group by socket, which every model makes use of."""
EXTREME = {"Roughness": 1.0, "IOR": 3.0}
BSDF = {
    "Diffuse": "ShaderNodeBsdfDiffuse",
    "Principled": "ShaderNodeBsdfPrincipled",
    "Subsurface": "ShaderNodeSubsurfaceScattering",
}
"""Blender's own nodes that convert takes."""
every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)

SCRIPTS = Path(__file__).resolve().parent.parent / "scripts"


def run_script(name: str, *arguments: str | Path, cwd: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run one of the scripts as its user would: a process of its own in the folder `cwd`."""
    command = [sys.executable, SCRIPTS / name, *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd, env=os.environ | environment)


def assert_bad_input(result: subprocess.CompletedProcess[str], name: str) -> None:
    """Assert that a script refused its options in one line, with status 2."""
    assert result.returncode == 2, result.stdout + result.stderr
    assert len(result.stderr.splitlines()) == 1 and result.stderr.startswith(name), result.stderr


def wait_for[Found](find: Callable[[], Found], seconds: float = 120.0) -> Found:
    """Return what `find` finds once that is something; fail after so many seconds."""
    start = time.monotonic()
    while not (found := find()):
        assert time.monotonic() - start < seconds, "what was waited for did not come"
        time.sleep(0.02)
    return found


def scene_at_centers(width: int, height: int) -> bpy.types.Scene:
    """Return the scene for pictures of so many pixels, all samples at their centers, without bounces and background."""
    scene = bpy.context.scene
    settings = scene.render
    settings.resolution_x, settings.resolution_y = width, height
    settings.film_transparent, settings.filter_size = True, 0.0
    scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", render.CENTER
    engines.leave_out_bounces(scene)
    return scene


def specialize(node: bpy.types.Node) -> None:
    """Give `node` a group of its own as an earlier version did that optimized it for one use: all its nodes are still there."""
    tree = node.node_tree.copy()
    tree[SPECIALIZED_FOR] = "{}"
    del tree[BUILT_FINGERPRINT]
    node.node_tree = tree


def node_dump(tree: bpy.types.NodeTree) -> list[object]:
    """All of a node tree that an artist sees: its nodes with places, properties and values, and its links."""

    def value(socket: bpy.types.NodeSocket) -> object:
        own = getattr(socket, "default_value", None)
        return own if own is None or isinstance(own, (str, int, float)) else tuple(own)

    properties = ("label", "width", "hide", "mute", "distribution", "subsurface_method", "falloff", "operation")
    dump: list[object] = [
        (
            node.name,
            node.bl_idname,
            node.parent.name if node.parent else "",
            tuple(node.location),
            [getattr(node, name, "") for name in properties],
            [(socket.identifier, value(socket), socket.hide) for socket in node.inputs],
        )
        for node in sorted(tree.nodes, key=lambda node: node.name)
    ]
    ends = [
        (link.from_node.name, link.from_socket.identifier, link.to_node.name, link.to_socket.identifier, link.is_muted)
        for link in tree.links
    ]
    return [*dump, sorted(ends)]


def formulas() -> list[Formula]:
    """Every registered formula, with usual and with extreme inputs."""
    return [model.reference(inputs) for model in MODELS.values() for inputs in (USUAL, EXTREME)]


def show(*shown: bpy.types.Material) -> bpy.types.Object:
    """Return a new plane with one face for each of the materials."""
    mesh = bpy.data.meshes.new("Plane")
    corners = [(x, y, 0.0) for x in range(len(shown) + 1) for y in (0.0, 1.0)]
    mesh.from_pydata(corners, [], [(2 * i, 2 * i + 2, 2 * i + 3, 2 * i + 1) for i in range(len(shown))])
    mesh.uv_layers.new(name="UVMap")
    for material in shown:
        mesh.materials.append(material)
    for index, face in enumerate(mesh.polygons):
        face.material_index = index
    item = bpy.data.objects.new("Plane", mesh)
    bpy.context.scene.collection.objects.link(item)
    return item


def bsdf(kind: str, name: str = "Mine", **inputs: object) -> tuple[bpy.types.Material, bpy.types.Node]:
    """Return a new material without an output, and its only node, one of BSDF; sockets by name with _ for a space."""
    made = bpy.data.materials.new(name)
    made.node_tree.nodes.clear()
    node = made.node_tree.nodes.new(BSDF[kind])
    for socket, value in inputs.items():
        node.inputs[socket.replace("_", " ")].default_value = value
    return made, node


class CountedProgress:
    """A `Progress` that adds up the work of all steps."""

    def __init__(self) -> None:
        self.work = 0.0

    def step(self, text: str, work: float) -> AbstractContextManager[None]:
        self.work += work
        return nullcontext()

    def within(self, work: float) -> None:
        """Do nothing."""


class Layout:
    """Stands in for Blender's UILayout in a menu: collects texts and what is offered."""

    emboss = "PULLDOWN_MENU"

    def __init__(self, root: "Layout | None" = None) -> None:
        self.root = root or self
        self.texts: list[str] = []
        self.closed: list[str] = []
        self.offered: list[str] = []

    def __getattr__(self, name: str) -> Any:
        if name in ("row", "column", "split", "box"):
            return lambda **_: Layout(self.root)
        raise AttributeError(name)

    def panel(self, key: str, default_closed: bool = False) -> tuple["Layout", "Layout"]:
        self.root.closed += [key] if default_closed else []
        return Layout(self.root), Layout(self.root)

    def label(self, text: str = "", icon: str = "NONE", icon_value: int = 0) -> None:
        self.root.texts.append(text)

    def prop(self, owner: object, name: str, index: int = -1, text: str = "") -> None:
        assert hasattr(owner, name)
        self.root.texts.append(text)

    def menu(self, name: str) -> None:
        assert hasattr(bpy.types, name)
        self.root.offered.append(name)

    def popover(self, name: str, text: str = "") -> None:
        assert hasattr(bpy.types, name)
        self.root.offered.append(f"{name} {text}".strip())

    def operator(self, name: str, text: str = "", icon: str = "NONE", depress: bool = False) -> SimpleNamespace:
        module, _, operator = name.partition(".")
        assert getattr(getattr(bpy.ops, module), operator).get_rna_type()
        self.root.offered.append(f"{name} {text}{' chosen' if depress else ''}".strip())
        return SimpleNamespace()

    def progress(self, factor: float, text: str = "") -> None:
        assert 0.0 <= factor <= 1.0
        self.root.texts.append(text)

    def template_icon(self, icon: int, scale: float) -> None:
        self.root.offered.append("plot")

    def separator(self) -> None:
        pass
