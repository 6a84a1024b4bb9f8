# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine draws of a scene, kept between updates: only what changed is read again."""

import math
import time
from array import array
from dataclasses import dataclass, field, replace

import bpy

from ..material.surface import Rgb
from . import objects
from .changes import Changes
from .expressions import MeshAttribute
from .lights import Light, read_light
from .materials import GLOSSY, HOLDOUT, OUR_SAMPLERS, RenderMaterial, render_material, samplers
from .meshes import Mesh, is_finite
from .not_drawn import Omission, of_light_through
from .objects import Identity, IsShown, Part, Visibility
from .particle_hair import hair_material, hair_strips, hair_systems
from .program import MAX_LIGHTS, Inputs, Lighting, Variant
from .strips import Strips
from .world import NO_WORLD, World, read_world

BLACK: Rgb = (0.0, 0.0, 0.0)
NOT_DRAWN = {  # by Blender's types of objects
    "POINTCLOUD": Omission("OUTLINER_OB_POINTCLOUD", "point clouds are not drawn"),
    "VOLUME": Omission("OUTLINER_OB_VOLUME", "volumes are not drawn"),
}
NO_MATERIAL = 0  # in the place of a material's session_uid

type MeshKey = tuple[int, int]
"""A mesh: the address of its data, or of the object whose mesh Blender makes on demand, and the session_uid of its data."""
type RecordKey = tuple[MeshKey, int, Visibility]
"""An object: its mesh, its session_uid, and how it is shown."""


@dataclass(frozen=True, slots=True)
class Record:
    """What has been read of an object; `uids` are the session_uids of it and of its data, `omission` what is not drawn."""

    parts: tuple[Part, ...]
    uids: frozenset[int]
    omission: Omission | None


@dataclass
class SceneCache:
    """Meshes, materials and lights of a depsgraph, kept from one update to the next.

    `groups` has the objects that show each part, as indices of `matrices` (16 floats for each object, column by column, [m]).
    `materials` are those in use, by their session_uid. `environment` is the world. Each is replaced by another when it changes, and
    `version` counts the changes of the picture. `bounces_light`: as the scene's setting says. `is_complete`: whether all is
    read.
    """

    groups: dict[Part, list[int]] = field(default_factory=dict)
    matrices: array[float] = field(default_factory=lambda: array("f"))
    own_lights: list[Light] = field(default_factory=list)
    materials: dict[int, RenderMaterial] = field(default_factory=dict)
    environment: World = NO_WORLD
    bounces_light: bool = False
    version: int = 0
    is_complete: bool = True
    _world_suns: tuple[Light, ...] = ()
    _has_moving_world: bool = False  # which follows an object
    _depsgraph: int | None = None  # the address of that of the last update
    _is_render: bool = False  # rather than a viewport
    _settings: tuple[int, float] | None = None  # the view layer's material, and the length of a meter
    _identity: Identity | None = None  # of the objects in `groups`
    _names: dict[int, str] = field(default_factory=dict)  # of the materials
    _meshes: dict[MeshKey, Mesh | Strips] = field(default_factory=dict)
    _users: dict[MeshKey, set[int]] = field(default_factory=dict)  # session_uids of the data and the objects of each mesh
    _records: dict[RecordKey, Record] = field(default_factory=dict)
    _visibility: dict[int, Visibility] = field(default_factory=dict)  # of objects by their session_uid, as their own settings say
    _known: set[int] = field(default_factory=set)  # session_uids of objects that have been read, and of their data
    _drawn: set[int] = field(default_factory=set)  # the indices of objects in `groups`, of lights, and of what is left out
    _light_objects: set[int] = field(default_factory=set)
    _not_finite: set[int] = field(default_factory=set)
    _said: dict[str, list[Omission]] = field(default_factory=dict)  # by what they are about

    @property
    def lights(self) -> list[Light]:
        """The lights, the world's suns included."""
        return [*self.own_lights, *self._world_suns][:MAX_LIGHTS]

    @property
    def world(self) -> Rgb:
        """The radiance from everywhere [W/(m^2 sr)]; 0 of a world that varies."""
        diffuse = self.environment.diffuse
        return diffuse if self.environment.is_even and isinstance(diffuse, tuple) else BLACK

    @property
    def has_glossy(self) -> bool:
        """Whether any material in use reflects the world more or less sharply."""
        return any(GLOSSY & material.features for material in self.materials.values())

    @property
    def has_subsurface(self) -> bool:
        """Whether any material in use has subsurface scattering."""
        return any(material.has_subsurface for material in self.materials.values())

    @property
    def subsurface_reach(self) -> float:
        """How far light goes below the surface of any material in use [m]; 0 where none scatters."""
        return max((material.subsurface_reach for material in self.materials.values()), default=0.0)

    @property
    def warnings(self) -> list[Omission]:
        """What the picture lacks or shows in another way than the scene has it."""
        used = {uid: material for uid, material in self.materials.items() if uid in self._names}
        missing = {name for material in used.values() for name in material.missing}
        losses = [Omission("MATERIAL", str(loss), self._names[uid]) for uid, material in used.items() for loss in material.losses]
        said = [line for about in ("objects", "world", "lights") for line in self._said.get(about, ())]
        if self.has_subsurface:
            strips = {part.material for part in self.groups if part.is_strip}
            curves = sorted(self._names[uid] for uid, material in used.items() if uid in strips and material.has_subsurface)
            said += of_light_through(curves, bool(self.lights), self.environment.is_even, not any(self.world))
        return [*said, *(Omission("IMAGE_DATA", "the image cannot be read", name) for name in sorted(missing)), *losses]

    def lighting(self) -> Lighting:
        """Return what the scene's lights and world ask of all surface shaders."""
        types = frozenset(light.kind for light in self.lights)
        has_shadows, world = any(light.casts_shadow or self.has_subsurface for light in self.lights), self.environment
        if world.may_have_suns:  # whether it has them now or not, so that one that turns compiles nothing
            types |= {"SUN"}
            has_shadows |= world.has_shadows
        has_map = not world.is_even
        has_sky = has_map or any(self.world)
        is_lit = bool(types) or has_sky or any("EMISSION" in material.features for material in self.materials.values())
        bounces = self.bounces_light and is_lit
        return Lighting(types, has_shadows, has_sky or bounces, has_map, bounces)

    def variant(self, material: RenderMaterial, is_holdout: bool, is_strip: bool = False) -> Variant:
        """Return the shader variant for `material` under the scene's lights, or for the hole that a holdout of it cuts.

        `is_strip`: of curves.
        """
        inputs, features = Inputs.of(material.code, is_strip), material.features | ({HOLDOUT} if is_holdout else set())
        return Variant(material.model, inputs, features, self.has_subsurface, self.lighting())

    def layer_variant(self, material: RenderMaterial, is_strip: bool = False) -> Variant:
        """Return the shader variant for the layers of `material` in ray bundles; `is_strip`: of curves."""
        lighting = self.lighting()
        has_sky = lighting.world_map or any(self.world)
        lighting = replace(lighting, ambient=has_sky, bounce=has_sky)
        return Variant(material.model, Inputs.of(material.code, is_strip), material.features, False, lighting, is_layer=True)

    def update(self, depsgraph: bpy.types.Depsgraph, is_shown: IsShown | None = None, seconds: float = math.inf) -> bool:
        """Read what changed since the last update; return whether the picture changes.

        `is_shown` tells whether a viewport shows an object, None that it shows what its view layer does. After so many `seconds` of
        processor time what has another mesh is left for `read_rest`.
        """
        before = self.version
        self._is_render = depsgraph.mode == "RENDER"
        changes = Changes.of(depsgraph)
        override, meter = depsgraph.view_layer_eval.material_override, 1.0 / depsgraph.scene.unit_settings.scale_length
        settings = (override.original.session_uid if override else NO_MATERIAL, meter)
        before_it, self._depsgraph = self._depsgraph, depsgraph.as_pointer()
        if changes.is_empty and before_it != self._depsgraph:  # else what changed is not in this depsgraph
            self._meshes, self._settings = {}, None
        if settings != self._settings:
            self._settings, self._identity, self._records, self.materials = settings, None, {}, {}
        if self._identity is None or changes.scene or changes.images or (changes.moves and self._has_moving_world):
            self._read_world(depsgraph)
        lacking = self._reread_materials(depsgraph, changes)
        identity = self._identity
        if identity is None or changes.scene or changes.geometry or changes.is_empty:
            identity = objects.identity(depsgraph, is_shown)
        is_stale = identity != self._identity or not self.is_complete or bool(lacking) or self._is_stale(changes)
        moved = self._read_matrices(depsgraph) if is_stale or changes.moves else set()
        if is_stale or moved is None:
            self._forget(changes.geometry, lacking)
            self._read_objects(depsgraph, is_shown, seconds)
            self._identity = identity
        if is_stale or moved is None or changes.lights or moved & self._light_objects:
            self._read_lights(depsgraph)
        if moved and moved & self._drawn:
            self.version += 1
        return self.version != before

    def read_rest(self, depsgraph: bpy.types.Depsgraph, is_shown: IsShown | None, seconds: float) -> None:
        """Read what the last update has left, for so many `seconds` of processor time, and at least one mesh."""
        self._read_objects(depsgraph, is_shown, seconds)

    def follow(self, scene: bpy.types.Scene) -> None:
        """Read the settings of `scene` that are the engine's own, whose changes Blender may not announce."""
        if self.bounces_light != scene.true_diffuse.bounces_light:
            self.bounces_light = scene.true_diffuse.bounces_light
            self.version += 1

    @property
    def _meter(self) -> float:
        """The length of a meter in the scene's units."""
        return self._settings[1] if self._settings else 1.0

    def _is_stale(self, changes: Changes) -> bool:
        """Return whether `changes` are of the geometry of something that has been read, or of who sees an object."""
        seen = ((item.original.session_uid, Visibility.of(item)) for item in changes.shaded)
        return not changes.geometry.isdisjoint(self._known) or any(self._visibility.get(uid, now) != now for uid, now in seen)

    def _read_matrices(self, depsgraph: bpy.types.Depsgraph) -> set[int] | None:
        """Read where objects are; return which have moved, or None where there are others than before."""
        before, not_finite = self.matrices, self._not_finite
        now = objects.matrices(depsgraph)
        self._not_finite = objects.not_finite(now)
        if now != before:
            self.matrices = now
        return objects.moved(before, now) if len(now) == len(before) and self._not_finite == not_finite else None

    def _reread_materials(self, depsgraph: bpy.types.Depsgraph, changes: Changes) -> set[int]:
        """Read the changed materials in use again; return those that need other attributes of their meshes than before."""
        changed = {uid: material for uid, material in changes.materials.items() if uid in self.materials}
        if changes.images:  # whether an image has bytes or floats is part of the shader
            using = {uid for uid, material in self.materials.items() if not changes.images.isdisjoint(material.images)}
            for material in bpy.data.materials if using - changed.keys() else ():
                if material.session_uid in using:
                    changed[material.session_uid] = material.evaluated_get(depsgraph)
        if not changed:
            return set()
        before = self.materials
        self.materials = before | {uid: render_material(material, self._meter) for uid, material in changed.items()}
        self._names |= {uid: material.name for uid, material in changed.items()}
        self.version += self.materials != before
        return {uid for uid in changed if self.materials[uid].attributes != before[uid].attributes}

    def _forget(self, geometry: set[int], lacking: set[int]) -> None:
        """Drop what has been read of the meshes and objects that `geometry` names, and of objects of the materials `lacking`."""
        self._meshes = {key: mesh for key, mesh in self._meshes.items() if geometry.isdisjoint(self._users[key])}
        self._records = {
            key: record
            for key, record in self._records.items()
            if geometry.isdisjoint(record.uids) and not any(part.material in lacking for part in record.parts)
        }

    def _read_objects(self, depsgraph: bpy.types.Depsgraph, is_shown: IsShown | None, seconds: float) -> None:
        """Read objects of which nothing is kept, for so many `seconds` of processor time, and sort all into groups.

        Those whose mesh has been read take next to no time.
        """
        end = None  # set by the first that is read
        self.is_complete = True
        said: dict[Omission, None] = {}
        groups: dict[Part, list[int]] = {}
        records: dict[RecordKey, Record] = {}
        self._visibility, self._known, self._light_objects = {}, set(), set()
        has_collections, layer = bool(objects.layer_collections(depsgraph)), depsgraph.view_layer_eval
        for index, instance in enumerate(depsgraph.object_instances):
            item = instance.object
            kind = item.type
            # Blender lists the meshes of texts, curves and metaballs separately; CURVES are hair
            if kind not in ("MESH", "CURVES", "LIGHT", *NOT_DRAWN):
                continue
            owner = instance.parent if instance.is_instance else item
            if not (instance.show_self or instance.show_particles) or not (is_shown is None or is_shown(owner)):
                continue
            if kind in NOT_DRAWN:
                said[NOT_DRAWN[kind]._replace(name=item.name)] = None
                continue
            if index in self._not_finite:
                what = "left out, as its location or scale is not finite or too large"
                said[Omission("OBJECT_DATA", what, item.name)] = None
                continue
            if kind == "LIGHT":
                self._light_objects.add(index)
                continue
            uid, owner_uid = item.original.session_uid, owner.original.session_uid
            shown = self._visibility[uid] = Visibility.of(item)
            if owner_uid != uid:
                above = self._visibility[owner_uid] = Visibility.of(owner)
                shown = shown.with_owner(above)
            if has_collections:
                shown = shown.within_collections(owner, layer)
            self._known |= {uid, owner_uid}
            if not (shown.camera or shown.shadow or shown.diffuse):
                continue
            key = (self._mesh_key(item), uid, shown)
            record = records.get(key) or self._records.get(key)
            if record is None:
                now = time.thread_time()
                end = end or now + seconds
                if now > end and key[0] not in self._meshes:
                    self.is_complete = False
                    continue
                record = self._record(item, key, layer.material_override)
            records[key] = record
            if record.omission:
                said[record.omission] = None
            for part in record.parts if instance.show_self else (part for part in record.parts if part.is_strip):
                groups.setdefault(part, []).append(index)
        self._records = records
        self._known |= {uid for record in records.values() for uid in record.uids}
        used = {key for key, _, _ in records}
        self._meshes = {key: self._meshes[key] for key in used if key in self._meshes}
        self._users = {key: self._users[key] for key in self._meshes}
        self._drawn = {index for group in groups.values() for index in group}
        self._said["objects"] = list(said)
        materials = {part.material: self.materials[part.material] for part in groups}
        if groups != self.groups:
            self.groups = groups
            self.version += 1
        if materials != self.materials:
            self.materials = materials
            self.version += 1

    @staticmethod
    def _mesh_key(item: bpy.types.Object) -> MeshKey:
        data = item.data
        is_edited = item.type == "MESH" and data.is_editmode  # its mesh data is empty then
        return item.original.as_pointer() if is_edited else data.as_pointer(), (data.original or data).session_uid

    def _record(self, item: bpy.types.Object, key: RecordKey, override: bpy.types.Material | None) -> Record:
        """Return what is read of an object, with its mesh where that is kept."""
        mesh_key, uid, shown = key
        data = item.to_mesh() if item.type == "MESH" and item.data.is_editmode else item.data
        mesh = self._meshes.get(mesh_key)
        if mesh is None:
            mesh = self._meshes[mesh_key] = Strips.of(data) if item.type == "CURVES" else Mesh(data)
            self._users[mesh_key] = set()
        uids = frozenset((uid, mesh_key[1]))
        self._users[mesh_key] |= uids
        wanted: dict[int, tuple[MeshAttribute, ...]] = {}
        parts = []
        for slot in mesh.slots:
            material_uid = self._material(override or _slot_material(item, data, slot))
            wanted[slot] = self.materials[material_uid].attributes
            parts.append(Part(mesh, slot, material_uid, *shown))
        mesh.prepare(data, wanted, item.to_mesh)
        item.to_mesh_clear()
        for system in hair_systems(item, self._is_render):
            strips = hair_strips(item, system, self._is_render)
            material_uid = self._material(override or hair_material(item, system))
            strips.prepare(None, dict.fromkeys(strips.slots, self.materials[material_uid].attributes), item.to_mesh)
            parts += [Part(strips, slot, material_uid, *shown) for slot in strips.slots]
        what = f"{mesh.skipped} triangles are left out, as their vertices are not finite or too far away"
        return Record(tuple(parts), uids, Omission("MESH_DATA", what, item.name) if mesh.skipped else None)

    def _material(self, material: bpy.types.Material | None) -> int:
        """Return the key of a material in `materials`, which is read unless it is there."""
        uid = material.original.session_uid if material else NO_MATERIAL
        if uid not in self.materials:
            self.materials[uid] = render_material(material, self._meter)
            if material:
                self._names[uid] = material.name
        return uid

    def _read_lights(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Read the lights, at most MAX_LIGHTS of them."""
        said = self._said["lights"] = []
        found = [
            (instance.object.name, read_light(instance.object, instance.matrix_world))
            for index, instance in enumerate(depsgraph.object_instances if self._light_objects else ())
            if index in self._light_objects
        ]
        finite = [(name, light) for name, light in found if is_finite(light.strength)]
        left_out = [name for name, light in found if not is_finite(light.strength)]
        said += [Omission("LIGHT", "left out, as its power is not finite or too large", name) for name in left_out]
        said += [Omission("LIGHT", f"left out, as {MAX_LIGHTS} lights are drawn", name) for name, _ in finite[MAX_LIGHTS:]]
        lights = [light for _, light in finite[:MAX_LIGHTS]]
        if lights != self.own_lights:
            self.own_lights = lights
            self.version += 1

    def _read_world(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Read the world, or the view layer's in its place."""
        world = depsgraph.view_layer_eval.world_override or depsgraph.scene_eval.world
        reading = read_world(world, depsgraph, samplers() - OUR_SAMPLERS)
        self._said["world"], self._has_moving_world = reading.said, reading.follows_object
        if reading.world != self.environment or reading.world.images != self.environment.images:
            self.environment = reading.world
            self.version += 1

    def set_world_suns(self, suns: tuple[Light, ...]) -> None:
        """Have the lights include these, which the world has; of all, MAX_LIGHTS are drawn."""
        if suns != self._world_suns:
            self._world_suns = suns
            self.version += 1


def _slot_material(item: bpy.types.Object, mesh: bpy.types.Mesh, slot: int) -> bpy.types.Material | None:
    """Return the material of a slot. A slot beyond the last means the last, one below 0 the first, as in Cycles."""
    if slots := item.material_slots:
        return slots[max(0, min(slot, len(slots) - 1))].material
    return mesh.materials[max(0, min(slot, len(mesh.materials) - 1))] if mesh.materials else None
