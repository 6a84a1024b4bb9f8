# SPDX-License-Identifier: GPL-3.0-or-later
"""What of one material each target does not carry, in the words of the targets themselves.

USD and glTF are asked by exporting a small mesh that has the material, and the UV maps and color attributes of a mesh that uses it,
from a scene of its own into a temporary folder. So nothing of the file changes.
"""

from collections.abc import Callable, Generator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from tempfile import TemporaryDirectory

import bpy

from ..blender import report
from ..material.read import read_surface

CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))  # of the mesh, one triangle


@dataclass(frozen=True)
class CarriedBy:
    """What targets say of a material: lines by target, none where all is carried, None where this Blender lacks the exporter; and
    the material's fingerprint then."""

    lines: Mapping[str, tuple[str, ...] | None]
    fingerprint: int


def fingerprint(material: bpy.types.Material) -> int:
    """Return a number that tells whether what targets read of `material` has changed in this session."""
    reading = read_surface(material)
    surface = reading.surface
    settings = (getattr(surface, each.name) for each in fields(surface) if each.name != "inputs")
    # of hashes, which expressions keep: to compare two readings would visit shared expressions once for each path to them
    return hash((frozenset(surface.inputs.items()), tuple(reading.losses), *settings))


def realtime_losses(material: bpy.types.Material, scene: bpy.types.Scene) -> list[str]:
    """Return what the realtime engine does not draw of `material`, and what it draws instead."""
    from ..realtime.materials import render_material

    unit = scene.unit_settings.scale_length
    return [str(loss) for loss in render_material(material, 1.0 / unit if unit > 0.0 else 1.0).losses]


def exporters() -> dict[str, Callable[[Path], None]]:
    """Return what exports a scene to a folder, by target; without those that this Blender lacks."""
    found: dict[str, Callable[[Path], None]] = {}
    if bpy.app.build_options.usd:
        found["USD"] = _export_usd
    if hasattr(bpy.types, "EXPORT_SCENE_OT_gltf"):  # Blender's add-on may be disabled
        found["glTF"] = _export_gltf
    return found


def check_exports(material: bpy.types.Material, context: bpy.types.Context) -> CarriedBy:
    """Return what USD and glTF do not carry of `material`. Raises RuntimeError where an export fails."""
    lines: dict[str, tuple[str, ...] | None] = {"USD": None, "glTF": None}
    prefix = f"True Diffuse: {material.name}: "
    with TemporaryDirectory() as folder, _scene_with(material, context.scene) as scene:
        waiting = report.take()  # of an export before, not shown yet
        with context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
            for target, export in exporters().items():
                export(Path(folder))
                said = report.take()
                lines[target] = tuple(dict.fromkeys(line.removeprefix(prefix) for line in said if line.startswith(prefix)))
        report.put_back(waiting)
    return CarriedBy(lines, fingerprint(material))


def _export_usd(folder: Path) -> None:
    bpy.ops.wm.usd_export(filepath=str(folder / "material.usdc"), generate_materialx_network=True)


def _export_gltf(folder: Path) -> None:
    bpy.ops.export_scene.gltf(filepath=str(folder / "material.glb"), use_active_scene=True, export_animations=False)


@contextmanager
def _scene_with(material: bpy.types.Material, like: bpy.types.Scene) -> Generator[bpy.types.Scene]:
    """Give a scene, with the units of `like`, that holds a triangle of `material`; it is removed afterwards."""
    scene = bpy.data.scenes.new("True Diffuse Export Check")
    mesh = bpy.data.meshes.new("Triangle")
    item = bpy.data.objects.new("Triangle", mesh)
    try:
        scene.unit_settings.scale_length = like.unit_settings.scale_length
        scene.frame_set(like.frame_current)
        mesh.from_pydata(CORNERS, (), ((0, 1, 2),))
        mesh.materials.append(material)
        _copy_layers(mesh, material)
        scene.collection.objects.link(item)
        yield scene
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.meshes.remove(mesh)  # and the object with it


def _copy_layers(mesh: bpy.types.Mesh, material: bpy.types.Material) -> None:
    """Give `mesh` the UV maps and color attributes of a mesh that uses `material`."""
    users = (other for other in bpy.data.meshes if other != mesh and material in other.materials[:])
    user = next(users, None)
    if user is None:
        mesh.uv_layers.new()
        return
    for layer in user.uv_layers:
        mesh.uv_layers.new(name=layer.name).active_render = layer.active_render
    for attribute in user.color_attributes:
        mesh.color_attributes.new(attribute.name, attribute.data_type, attribute.domain)
    if user.color_attributes:
        mesh.color_attributes.render_color_index = user.color_attributes.render_color_index
