# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's second figure: one head with a BRDF, with a BSSRDF and with the mixed model, against the light."""

import math
from dataclasses import dataclass

import bpy

import bmesh
from mathutils import Matrix, Vector

from true_diffuse.addon.material import materials
from true_diffuse.addon.material.materials import Setting
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters.human import REGION_ATTRIBUTE, REGIONS

# Of the published media and tones the one that fits the paint: its diffuse reflectance is .62 .43 .34, the lightest paint's albedo
# .64 .40 .29. Its light also goes farthest: 4.8 mm of diffuse mean free path in red.
MEDIUM = PRESETS["skin_2"]
SIGMA = 0.33  # radians, of the mixed model's rough diffuse part
MIXED_SUBSURFACE = 0.7

YAW = math.radians(-28.0)  # heads turn towards the key, one ear towards the camera
FACE_HEIGHT = 0.34  # m, what is shown of a human from a little above the crown down
PANEL = 5.0 / 6.0  # width of what is shown of one character over its height
AIR = 0.04  # above the crown, as a share of the height shown
DISTANCE = 5.0  # m, of the camera
STAGGER = 0.2  # m, by which each head is nearer than the one to its left, out of its shadow
# Suns: towards the lamp, irradiance [W/m^2] on a plane that faces it, angle across [degrees], linear RGB
KEY = (Vector((-0.62, -0.70, 0.42)), 2.3, 3.0, (1.0, 0.96, 0.91))
BACK = (Vector((0.42, 0.86, 0.30)), 12.0, 3.0, (1.0, 0.98, 0.95))
SURROUNDINGS = (0.022, 0.025, 0.030)  # radiance of the sky all around [W/(m^2 sr)], which is the backdrop, too
CLOTHES = 0.4  # times their paint: dark enough to leave the eye on the face
EYE_ROUGHNESS, EYE_IOR = 0.08, 1.38


@dataclass(frozen=True)
class Look:
    """How one head's skin is shaded: the inputs of the group Subsurface."""

    name: str
    label: str
    inputs: dict[str, Setting]


LOOKS = (
    Look("brdf", "BRDF:  Lambert", {"Model": "Lambert", "Subsurface": 0.0, "Specular": 0.0}),
    Look("bssrdf", "BSSRDF:  subsurface alone", {"Subsurface": 1.0, "Specular": 0.0}),
    Look(
        "mixed",
        "Mixed:  specular over both",
        {"Subsurface": MIXED_SUBSURFACE, "Roughness": SIGMA, "Specular": 1.0, "Specular Roughness": 0.5},
    ),
)


@dataclass(frozen=True)
class Head:
    """One head of the scene."""

    look: Look
    subject: bpy.types.Object


@dataclass(frozen=True)
class Face:
    """The scene with what a measurement needs of it. `regions` is a Diffuse material whose albedo is `region_albedo`."""

    scene: bpy.types.Scene
    heads: tuple[Head, ...]
    lamps: tuple[bpy.types.Object, ...]
    regions: bpy.types.Material


def region_albedo(region: str) -> float:
    """Return the albedo that stands for a region of skin in renders of `Face.regions`; what is no region has another."""
    return REGIONS.index(region) / len(REGIONS)


def build(mesh: bpy.types.Mesh, closeup: bool, resolution: tuple[int, int]) -> Face:
    """Return a new scene with `mesh` once per look, framed for `resolution` in pixels.

    `closeup` shows a human's head and shoulders, else all of the character. A mesh without REGION_ATTRIBUTE is all skin.
    """
    scene = bpy.data.scenes.new("True Diffuse Face")
    scene.render.resolution_x, scene.render.resolution_y = resolution
    scene.view_settings.view_transform = "Standard"
    scene.cycles.max_bounces = 4
    top = max(vertex.co.z for vertex in mesh.vertices)
    height = FACE_HEIGHT if closeup else top * (1.0 + 2.0 * AIR)
    step = height * PANEL
    bust = _bust(mesh, step, top - 1.5 * height)
    other, eyes = _other(), _eyes()
    heads = []
    for index, look in enumerate(LOOKS):
        subject = bpy.data.objects.new(look.label, bust)
        place = index - (len(LOOKS) - 1) / 2
        subject.location = (place * step, -place * STAGGER, 0.0)
        scene.collection.objects.link(subject)
        for slot, material in zip(subject.material_slots, (other, eyes, _skin(look)), strict=True):
            slot.link = "OBJECT"
            slot.material = material
        heads.append(Head(look, subject))
    _camera(scene, step * len(LOOKS), height, top + AIR * height)
    _surround(scene)
    lamps = (_sun(scene, "Key", *KEY), _sun(scene, "Back", *BACK))
    scene.view_layers[0].update()
    return Face(scene, tuple(heads), lamps, _regions())


def _bust(mesh: bpy.types.Mesh, width: float, bottom: float) -> bpy.types.Mesh:
    """Return a copy turned by YAW and cut off at `width` [m] and the height `bottom` [m], so that none covers its neighbor.

    It has a slot each for the rest, the eyes and the skin.
    """
    part = bmesh.new()
    part.from_mesh(mesh)
    bmesh.ops.transform(part, matrix=Matrix.Rotation(YAW, 4, "Z"), verts=part.verts)
    for point, normal in (
        (Vector((width / 2, 0, 0)), Vector((1, 0, 0))),
        (Vector((-width / 2, 0, 0)), Vector((-1, 0, 0))),
        (Vector((0, 0, bottom)), Vector((0, 0, -1))),
    ):
        everything = [*part.verts, *part.edges, *part.faces]
        bmesh.ops.bisect_plane(part, geom=everything, dist=1e-6, plane_co=point, plane_no=normal, clear_outer=True)
    skin = REGIONS.index("other skin")
    region = part.faces.layers.int.get(REGION_ATTRIBUTE)
    if region is None:
        region = part.faces.layers.int.new(REGION_ATTRIBUTE)
        for face in part.faces:
            face[region] = skin
    for face in part.faces:
        face.material_index = min(face[region], skin)
    bust = bpy.data.meshes.new("Bust")
    part.to_mesh(bust)
    part.free()
    for _ in range(skin + 1):
        bust.materials.append(None)
    return bust


def _skin(look: Look) -> bpy.types.Material:
    inputs = {"Subsurface Radius": MEDIUM.inputs["Subsurface Radius"]} | look.inputs
    material = materials.create(look.label, SUBSURFACE, **inputs)
    materials.paint(material, material.node_tree.nodes[SUBSURFACE.name].inputs["Color"], ALBEDO_ATTRIBUTE, 1.0)
    return material


def _other() -> bpy.types.Material:
    """Return the material of hair and clothes."""
    material = materials.create("Hair and Clothes", ROUGH_DIFFUSE, Roughness=SIGMA)
    materials.paint(material, material.node_tree.nodes[ROUGH_DIFFUSE.name].inputs["Color"], ALBEDO_ATTRIBUTE, CLOTHES)
    return material


def _eyes() -> bpy.types.Material:
    """Return the material of the eyes: Lambert under the coat alone, wet."""
    inputs = {"Model": "Lambert", "Subsurface": 0.0, "Specular Roughness": EYE_ROUGHNESS, "IOR": EYE_IOR}
    material = materials.create("Eyes", SUBSURFACE, **inputs)
    materials.paint(material, material.node_tree.nodes[SUBSURFACE.name].inputs["Color"], ALBEDO_ATTRIBUTE, 1.0)
    return material


def _regions() -> bpy.types.Material:
    material, node = materials.create_plain("Regions")
    materials.paint(material, node.inputs["Color"], REGION_ATTRIBUTE, 1.0 / len(REGIONS))
    return material


def _camera(scene: bpy.types.Scene, width: float, height: float, top: float) -> None:
    """Add a level camera that shows at least `width` by `height` [m] below the height `top` [m], all heads from the same side."""
    aspect = scene.render.resolution_x / scene.render.resolution_y
    frame_width = max(width, height * aspect)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.sensor_fit, camera.ortho_scale = "ORTHO", "HORIZONTAL", frame_width
    camera.clip_start, camera.clip_end = DISTANCE / 2.0, DISTANCE * 2.0
    holder = bpy.data.objects.new("Camera", camera)
    place = Matrix.Translation((0.0, -DISTANCE, top - frame_width / aspect / 2.0))
    holder.matrix_world = place @ Matrix.Rotation(math.pi / 2, 4, "X")
    scene.collection.objects.link(holder)
    scene.camera = holder


def _sun(
    scene: bpy.types.Scene, name: str, direction: Vector, irradiance: float, angle: float, color: tuple[float, float, float]
) -> bpy.types.Object:
    lamp = bpy.data.lights.new(name, "SUN")
    lamp.energy, lamp.angle, lamp.color = irradiance, math.radians(angle), color
    sun = bpy.data.objects.new(name, lamp)
    sun.matrix_world = direction.to_track_quat("Z", "Y").to_matrix().to_4x4()
    scene.collection.objects.link(sun)
    return sun


def _surround(scene: bpy.types.Scene) -> None:
    world = bpy.data.worlds.new("Surroundings")
    background = next(node for node in world.node_tree.nodes if node.type == "BACKGROUND")
    background.inputs["Color"].default_value = (*SURROUNDINGS, 1.0)
    scene.world = world
