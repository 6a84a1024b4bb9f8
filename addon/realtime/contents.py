# SPDX-License-Identifier: GPL-3.0-or-later
"""What is in a scene, as the realtime engine draws it; only what changed is read again."""

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy

from mathutils import Matrix

from ..material.read import Names, feeding, read_color, read_number
from ..material.surface import Rgb
from .layers import Layer
from .lights import Lamp, lamp_of
from .materials import Look, look_of
from .meshes import Mesh, is_sound
from .program import MOST_LAMPS, Light, Variant

LOOKS = (bpy.types.Material, bpy.types.NodeTree)
SHADED = (bpy.types.Mesh, bpy.types.Curve, bpy.types.MetaBall)
BLACK: Rgb = (0.0, 0.0, 0.0)
NONE = 0  # the number of no material

type Key = tuple[int, int]
"""A mesh: where it, or the object it is made for, is in memory; Blender's number of its data, new at each evaluation."""


@dataclass(frozen=True)
class Part:
    """The faces of one material of one object. `number` tells objects apart."""

    mesh: Mesh
    slot: int
    material: int
    matrix: Matrix
    number: int
    is_seen: bool
    casts: bool


@dataclass
class Contents:
    """Meshes, materials and lamps of a depsgraph, kept from one update to the next.

    `looks` are the materials in use by Blender's numbers for them; `world` is the radiance from everywhere [W/(m^2 sr)].
    `parts` is another list whenever objects, meshes or lamps may have changed.
    """

    parts: list[Part] = field(default_factory=list)
    lamps: list[Lamp] = field(default_factory=list)
    looks: dict[int, Look] = field(default_factory=dict)
    world: Rgb = BLACK
    _left_out: list[str] = field(default_factory=list)
    _meshes: dict[Key, Mesh] = field(default_factory=dict)
    _owners: dict[Key, set[int]] = field(default_factory=dict)
    _visible: dict[int, tuple[bool, bool]] = field(default_factory=dict)  # of objects, by camera and in shadows
    _is_read: bool = False

    @property
    def scatters(self) -> bool:
        return any(look.scatters for look in self.looks.values())

    @property
    def notes(self) -> list[str]:
        """What is not drawn as it should be."""
        textures = (texture for look in self.looks.values() for texture in look.textures.values())
        lacking = {texture.source.file for texture in textures if texture.is_lacking}
        return self._left_out + [f"{file} cannot be read" for file in sorted(lacking)]

    def light(self) -> Light:
        """Return what the light asks of all shaders."""
        return Light(frozenset(lamp.kind for lamp in self.lamps), any(lamp.casts for lamp in self.lamps), any(self.world))

    def variant(self, look: Look) -> Variant:
        """Return the shader that draws `look` here."""
        return Variant(look.law, look.paint, look.coat[0] > 0.0, look.scatters, self.scatters, self.light(), look.relief)

    def update(self, depsgraph: bpy.types.Depsgraph, shows: Callable[[bpy.types.Object], bool] = lambda _: True) -> None:
        """Read what changed since the last time. `shows` says of an object whether a viewport does."""
        stale = {update.id.original.session_uid for update in depsgraph.updates if update.is_updated_geometry}
        self._meshes = {key: mesh for key, mesh in self._meshes.items() if not stale & self._owners[key]}
        only_looks = self._is_read and depsgraph.updates and all(map(self._is_of_looks, depsgraph.updates))
        if not (only_looks and self._reread_looks(depsgraph)):
            self._read(depsgraph, shows)

    def _is_of_looks(self, update: bpy.types.DepsgraphUpdate) -> bool:
        """Return whether a change is one of materials, or of what Blender tags for having them."""
        item = update.id
        if isinstance(item, LOOKS):
            return True
        if update.is_updated_geometry or update.is_updated_transform:
            return False
        if isinstance(item, bpy.types.Object):
            return self._visible.get(item.original.session_uid) == (item.visible_camera, item.visible_shadow)
        return isinstance(item, SHADED)

    def _reread_looks(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Read the materials again; returns False where one needs more of its meshes than before."""
        meter = _meter(depsgraph.scene)
        for material in bpy.data.materials:
            before = self.looks.get(material.session_uid)
            if before:
                now = look_of(material.evaluated_get(depsgraph), meter)
                if now.layers != before.layers:
                    return False
                self.looks[material.session_uid] = now
        return True

    def _read(self, depsgraph: bpy.types.Depsgraph, shows: Callable[[bpy.types.Object], bool]) -> None:
        """Read objects, materials, lamps and world."""
        self._is_read = False  # until all is
        self.parts, self.lamps, self.looks, self._left_out, self._visible = [], [], {}, [], {}
        before, self._meshes = self._meshes, {}
        override, meter = depsgraph.view_layer_eval.material_override, _meter(depsgraph.scene)
        for number, instance in enumerate(depsgraph.object_instances, 1):
            item = instance.object
            if not instance.show_self or not shows(instance.parent if instance.is_instance else item):
                continue
            matrix = instance.matrix_world.copy()
            if item.type not in ("MESH", "LIGHT"):  # of text, curves, surfaces and metaballs Blender lists the meshes, too
                continue
            if not all(map(is_sound, matrix)):
                self._left_out.append(f"{item.name} is left out: its place or size is no number, or too large")
            elif item.type == "LIGHT":
                self.lamps.append(lamp_of(item, matrix))
            elif item.visible_camera or item.visible_shadow:
                self._visible[item.original.session_uid] = (item.visible_camera, item.visible_shadow)
                self._add(item, matrix, number, before, override, meter)
        self._owners = {key: self._owners[key] for key in self._meshes}
        self.world = _radiance(depsgraph.scene_eval.world)
        if not is_sound(self.world):
            self._left_out.append("The world is black: its radiance is no number, or too large")
            self.world = BLACK
        shining = [lamp for lamp in self.lamps if is_sound(lamp.strength)]
        if len(shining) < len(self.lamps):
            self._left_out.append(f"{len(self.lamps) - len(shining)} lamps are left out: their power is no number, or too large")
        self.lamps = shining
        if len(self.lamps) > MOST_LAMPS:
            self._left_out.append(f"{MOST_LAMPS} of {len(self.lamps)} lamps are drawn")
            del self.lamps[MOST_LAMPS:]
        self._is_read = True

    def _add(
        self,
        item: bpy.types.Object,
        matrix: Matrix,
        number: int,
        before: dict[Key, Mesh],
        override: bpy.types.Material | None,
        meter: float,
    ) -> None:
        """Add the parts of one object, whose mesh is taken from `before` if it is there."""
        is_made = item.type != "MESH" or item.data.is_editmode  # that of one in edit mode has nothing in it
        data = item.to_mesh() if is_made else item.data
        if data is None:
            return
        source = item.data.original or item.data
        key = (item.original.as_pointer() if is_made else data.as_pointer(), source.session_uid)
        mesh = self._meshes.get(key) or before.get(key) or Mesh(data)
        if key not in self._meshes:
            self._meshes[key] = mesh
            self._owners[key] = set()
            if mesh.lost:
                self._left_out.append(f"{mesh.lost} triangles of {item.name} are left out: their places are no numbers, or too far")
        self._owners[key] |= {item.original.session_uid, source.session_uid}
        wanted: dict[int, tuple[Layer, ...]] = {}
        for slot in mesh.parts:
            material = override or _material(item, data, slot)
            uid = material.original.session_uid if material else NONE
            if uid not in self.looks:
                self.looks[uid] = look_of(material, meter)
            wanted[slot] = self.looks[uid].layers
            self.parts.append(Part(mesh, slot, uid, matrix, number, item.visible_camera, item.visible_shadow))
        mesh.prepare(data, wanted, item.to_mesh)
        item.to_mesh_clear()


def _material(item: bpy.types.Object, mesh: bpy.types.Mesh, slot: int) -> bpy.types.Material | None:
    """Return the material of a slot; faces whose slot is not there have the last one's, of a slot below 0 the first's."""
    if slots := item.material_slots:
        return slots[_within(slot, len(slots))].material
    return mesh.materials[_within(slot, len(mesh.materials))] if mesh.materials else None


def _within(slot: int, count: int) -> int:
    return max(0, min(slot, count - 1))


def _meter(scene: bpy.types.Scene) -> float:
    """Return a meter in the scene's units."""
    return 1.0 / scene.unit_settings.scale_length


def _radiance(world: bpy.types.World | None) -> Rgb:
    """Return the radiance of a world of one color [W/(m^2 sr)]; of others, that of the color beside their texture."""
    if world is None:
        return BLACK
    output = world.node_tree.get_output_node("ALL") if world.node_tree else None
    if output is None:
        return tuple(world.color)
    socket = feeding(output.inputs["Surface"])
    if socket is None or socket.node.type != "BACKGROUND" or socket.node.mute:
        return BLACK
    names, inputs = Names(str, str), socket.node.inputs
    color, _ = read_color(inputs["Color"], names)
    strength = read_number(inputs["Strength"], names)
    return color[0] * strength, color[1] * strength, color[2] * strength
