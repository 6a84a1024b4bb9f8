# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine draws of a scene, kept between updates: only what changed is read again."""

from collections.abc import Callable
from dataclasses import dataclass, field

import bpy

from mathutils import Matrix

from ..material.expression import Constant, triple
from ..material.links import Place, is_nothing, source
from ..material.read_nodes import NodeReader, UnsupportedInput
from ..material.surface import Rgb
from .expressions import MeshAttribute
from .lights import Light, read_light
from .materials import RenderMaterial, render_material
from .meshes import Mesh, is_finite
from .program import MAX_LIGHTS, Inputs, Lighting, Variant

MATERIAL_TYPES = (bpy.types.Material, bpy.types.NodeTree)
GEOMETRY_TYPES = (bpy.types.Mesh, bpy.types.Curve, bpy.types.MetaBall)
BLACK: Rgb = (0.0, 0.0, 0.0)
NO_MATERIAL = 0  # in the place of a material's session_uid

type Key = tuple[int, int]
"""A mesh: the address of its data, or of the object whose mesh Blender makes on demand, and the session_uid of its data."""


@dataclass(frozen=True)
class DrawItem:
    """The faces of one material slot of one object.

    `material` is the material's key in SceneCache.materials, `number` tells objects apart, `is_visible` is to the camera.
    """

    mesh: Mesh
    slot: int
    material: int
    matrix: Matrix
    number: int
    is_visible: bool
    casts_shadow: bool


@dataclass
class SceneCache:
    """Meshes, materials and lights of a depsgraph, kept from one update to the next.

    `items` is a new list whenever objects, meshes or lights may have changed. `materials` are those in use, by their session_uid.
    `world` is the radiance from everywhere [W/(m^2 sr)].
    """

    items: list[DrawItem] = field(default_factory=list)
    lights: list[Light] = field(default_factory=list)
    materials: dict[int, RenderMaterial] = field(default_factory=dict)
    world: Rgb = BLACK
    _warnings: list[str] = field(default_factory=list)
    _names: dict[int, str] = field(default_factory=dict)  # of the materials
    _meshes: dict[Key, Mesh] = field(default_factory=dict)
    _users: dict[Key, set[int]] = field(default_factory=dict)  # session_uids of the data and the objects of each mesh
    _visibility: dict[int, tuple[bool, bool]] = field(default_factory=dict)  # of objects, to the camera and to shadows
    _is_read: bool = False

    @property
    def has_subsurface(self) -> bool:
        """Whether any material in use has subsurface scattering."""
        return any(material.has_subsurface for material in self.materials.values())

    @property
    def warnings(self) -> list[str]:
        """What the picture lacks or shows in another way than the scene has it, one sentence each."""
        used = {uid: material for uid, material in self.materials.items() if uid in self._names}
        missing = {image.name for material in used.values() for image in material.textures if material.is_missing(image)}
        losses = [f"{self._names[uid]}: {loss}" for uid, material in used.items() for loss in material.losses]
        return [*self._warnings, *(f"{name} cannot be read" for name in sorted(missing)), *losses]

    def lighting(self) -> Lighting:
        """Return what the scene's lights and world ask of all surface shaders."""
        types = frozenset(light.kind for light in self.lights)
        return Lighting(types, any(light.casts_shadow for light in self.lights), any(self.world))

    def variant(self, material: RenderMaterial) -> Variant:
        """Return the shader variant for `material` under the scene's lights."""
        inputs = Inputs.of(material.code)
        return Variant(material.model, inputs, material.features, self.has_subsurface, self.lighting())

    def update(self, depsgraph: bpy.types.Depsgraph, is_shown: Callable[[bpy.types.Object], bool] = lambda _: True) -> None:
        """Read what changed since the last update. `is_shown` tells whether a viewport shows an object."""
        stale = {update.id.original.session_uid for update in depsgraph.updates if update.is_updated_geometry}
        self._meshes = {key: mesh for key, mesh in self._meshes.items() if not stale & self._users[key]}
        only_materials = self._is_read and depsgraph.updates and all(map(self._concerns_materials, depsgraph.updates))
        if not (only_materials and self._reread_materials(depsgraph)):
            self._read(depsgraph, is_shown)

    def _concerns_materials(self, update: bpy.types.DepsgraphUpdate) -> bool:
        """Return whether a change is one of materials alone; Blender tags their users with them."""
        item = update.id
        if isinstance(item, MATERIAL_TYPES):
            return True
        if update.is_updated_geometry or update.is_updated_transform:
            return False
        if isinstance(item, bpy.types.Object):
            return self._visibility.get(item.original.session_uid) == (item.visible_camera, item.visible_shadow)
        return isinstance(item, GEOMETRY_TYPES)

    def _reread_materials(self, depsgraph: bpy.types.Depsgraph) -> bool:
        """Read the materials again. Returns False where one needs other attributes of its meshes than before."""
        meter = 1.0 / depsgraph.scene.unit_settings.scale_length
        for material in bpy.data.materials:
            before = self.materials.get(material.session_uid)
            if before:
                now = render_material(material.evaluated_get(depsgraph), meter)
                if now.attributes != before.attributes:
                    return False
                self.materials[material.session_uid] = now
        return True

    def _read(self, depsgraph: bpy.types.Depsgraph, is_shown: Callable[[bpy.types.Object], bool]) -> None:
        """Read objects, materials, lights and world."""
        self._is_read = False  # until the end, in case of an error
        self.items, self.lights, self.materials, self._warnings, self._visibility = [], [], {}, [], {}
        self._names = {}
        before, self._meshes = self._meshes, {}
        override, meter = depsgraph.view_layer_eval.material_override, 1.0 / depsgraph.scene.unit_settings.scale_length
        for number, instance in enumerate(depsgraph.object_instances, 1):
            item = instance.object
            if not instance.show_self or not is_shown(instance.parent if instance.is_instance else item):
                continue
            matrix = instance.matrix_world.copy()
            if item.type not in ("MESH", "LIGHT"):  # Blender lists the meshes of texts, curves, surfaces and metaballs separately
                continue
            if not all(map(is_finite, matrix)):
                self._warnings.append(f"{item.name} is left out: its location or scale is not finite or too large")
            elif item.type == "LIGHT":
                self.lights.append(read_light(item, matrix))
            elif item.visible_camera or item.visible_shadow:
                self._visibility[item.original.session_uid] = (item.visible_camera, item.visible_shadow)
                if item.is_holdout:
                    self._warnings.append(f"{item.name}: Holdout is not supported, the object is drawn")
                self._add(item, matrix, number, before, override, meter)
        self._users = {key: self._users[key] for key in self._meshes}
        self.world, said = _world_radiance(depsgraph.view_layer_eval.world_override or depsgraph.scene_eval.world)
        self._warnings += said
        if not is_finite(self.world):
            self._warnings.append("The world is black: its radiance is not finite or too large")
            self.world = BLACK
        finite = [light for light in self.lights if is_finite(light.strength)]
        if len(finite) < len(self.lights):
            self._warnings.append(f"{len(self.lights) - len(finite)} lights are left out: their power is not finite or too large")
        self.lights = finite
        if len(self.lights) > MAX_LIGHTS:
            self._warnings.append(f"{MAX_LIGHTS} of {len(self.lights)} lights are drawn")
            del self.lights[MAX_LIGHTS:]
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
        """Add the draw items of one object, with its mesh from `before` if it is there."""
        is_made = item.type != "MESH" or item.data.is_editmode  # the mesh data of an object in edit mode is empty
        data = item.to_mesh() if is_made else item.data
        if data is None:
            return
        source = item.data.original or item.data
        key = (item.original.as_pointer() if is_made else data.as_pointer(), source.session_uid)
        mesh = self._meshes.get(key) or before.get(key) or Mesh(data)
        if key not in self._meshes:
            self._meshes[key] = mesh
            self._users[key] = set()
            if mesh.skipped:
                self._warnings.append(
                    f"{mesh.skipped} triangles of {item.name} are left out: their vertices are not finite or too far away"
                )
        self._users[key] |= {item.original.session_uid, source.session_uid}
        wanted: dict[int, tuple[MeshAttribute, ...]] = {}
        for slot in mesh.slots:
            material = override or _slot_material(item, data, slot)
            uid = material.original.session_uid if material else NO_MATERIAL
            if uid not in self.materials:
                self.materials[uid] = render_material(material, meter)
                if material:
                    self._names[uid] = material.name
            wanted[slot] = self.materials[uid].attributes
            self.items.append(DrawItem(mesh, slot, uid, matrix, number, item.visible_camera, item.visible_shadow))
        mesh.prepare(data, wanted, item.to_mesh)
        item.to_mesh_clear()


def _slot_material(item: bpy.types.Object, mesh: bpy.types.Mesh, slot: int) -> bpy.types.Material | None:
    """Return the material of a slot. A slot beyond the last means the last, one below 0 the first, as in Cycles."""
    if slots := item.material_slots:
        return slots[max(0, min(slot, len(slots) - 1))].material
    return mesh.materials[max(0, min(slot, len(mesh.materials) - 1))] if mesh.materials else None


def _world_radiance(world: bpy.types.World | None) -> tuple[Rgb, list[str]]:
    """Return the radiance of a world of one color [W/(m^2 sr)], and lines on what of the world is not drawn."""
    if world is None:
        return BLACK, []
    output = world.node_tree.get_output_node("ALL") if world.node_tree else None
    if output is None:
        return tuple(world.color), []
    background = source(Place(output.inputs["Surface"]))
    if not background.socket.is_output or is_nothing(background):
        return BLACK, []
    if background.node.type != "BACKGROUND":
        return BLACK, [f"The world is black: the node {background.node.bl_label} is not drawn"]
    reader, said, values = NodeReader(), [], []
    for name in ("Color", "Strength"):
        place = background.input(name)
        try:
            value = reader.expression(place)
        except UnsupportedInput:
            value = None
        if not isinstance(value, Constant):
            value = reader.own(place)
            said.append(f"What is linked to the world's {name} is not drawn, the socket's own value is")
        values.append(triple(value.value))
    red, green, blue = (color * strength for color, strength in zip(*values, strict=True))
    return (red, green, blue), said
