# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's second figure: one head with a BRDF, with a BSSRDF and with the mixed model, lit from behind."""

import math
from dataclasses import dataclass

import bpy

import bmesh
from mathutils import Matrix

from true_diffuse.addon.blender import color_spaces
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.materials import Setting
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.scenes.elements import add, add_sun, uniform_world
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters.human import REGION_ATTRIBUTE, REGIONS

# The published medium nearest to the paint: its diffuse reflectance is .62 .43 .34, the lightest paint's albedo .64 .40 .29. Its
# light also travels farthest: 4.8 mm of diffuse mean free path in red.
MEDIUM = PRESETS["skin_2"]
SIGMA = 0.33  # radians, of the mixed model's rough diffuse part
MIXED_SUBSURFACE = 0.7

YAW = math.radians(-28.0)  # heads face the key light, one ear the camera
FACE_HEIGHT = 0.34  # m, shown of a human from a little above the crown down
PANEL = 5.0 / 6.0  # aspect ratio of the part of the picture that shows one character
MARGIN = 0.04  # above the crown, as a fraction of the height shown
DISTANCE = 5.0  # m, of the camera
STAGGER = 0.2  # m, by which each head is nearer to the camera than the one to its left, out of its shadow
# Suns: direction towards the light, irradiance [W/m^2] on a plane facing it, angle [radians], linear RGB
KEY = ((-0.62, -0.70, 0.42), 2.3, math.radians(3.0), (1.0, 0.96, 0.91))
BACK = ((0.42, 0.86, 0.30), 12.0, math.radians(3.0), (1.0, 0.98, 0.95))
SURROUNDINGS = (0.022, 0.025, 0.030)  # radiance of the sky [W/(m^2 sr)], which is also the backdrop
CLOTHES = 0.4  # scales their paint: dark enough to draw the eye to the face
EYE_ROUGHNESS, EYE_IOR = 0.08, 1.38


@dataclass(frozen=True)
class HeadLook:
    """How one head's skin is shaded: the inputs of the group Subsurface."""

    name: str
    label: str
    inputs: dict[str, Setting]


LOOKS = (
    HeadLook("brdf", "BRDF:  Lambert", {"Model": "Lambert", "Subsurface": 0.0, "Specular": 0.0}),
    HeadLook("bssrdf", "BSSRDF:  subsurface alone", {"Subsurface": 1.0, "Specular": 0.0}),
    HeadLook(
        "mixed",
        "Mixed:  specular over both",
        {"Subsurface": MIXED_SUBSURFACE, "Roughness": SIGMA, "Specular": 1.0, "Specular Roughness": 0.5},
    ),
)


@dataclass(frozen=True)
class Head:
    """One head of the scene."""

    look: HeadLook
    subject: bpy.types.Object


@dataclass(frozen=True)
class Face:
    """The scene and its parts. `regions` is a Diffuse BSDF whose albedo names the region of skin, see `region_albedo`."""

    scene: bpy.types.Scene
    heads: tuple[Head, ...]
    lights: tuple[bpy.types.Object, ...]
    regions: bpy.types.Material


def region_albedo(region: str) -> float:
    """Return the albedo that stands for a region of skin in renders of `Face.regions`; other regions have other values."""
    return REGIONS.index(region) / len(REGIONS)


def build(mesh: bpy.types.Mesh, closeup: bool, resolution: tuple[int, int]) -> Face:
    """Return a new scene with `mesh` in each look, framed for `resolution` [pixels].

    `closeup` shows a human's head and shoulders; without, the whole character is seen. A mesh without REGION_ATTRIBUTE is all skin.
    """
    scene = bpy.data.scenes.new("True Diffuse Face")
    scene.render.resolution_x, scene.render.resolution_y = resolution
    color_spaces.show_plainly(scene)
    scene.cycles.max_bounces = 4
    top = max(vertex.co.z for vertex in mesh.vertices)
    height = FACE_HEIGHT if closeup else top * (1.0 + 2.0 * MARGIN)
    step = height * PANEL
    bust = _bust(mesh, step, top - 1.5 * height)
    other = materials.create("Hair and Clothes", ROUGH_DIFFUSE, Roughness=SIGMA)
    _paint(other, CLOTHES)
    wet = {"Model": "Lambert", "Subsurface": 0.0, "Specular Roughness": EYE_ROUGHNESS, "IOR": EYE_IOR}
    eyes = materials.create("Eyes", SUBSURFACE, **wet)  # Lambert under the specular coat
    _paint(eyes)
    heads = []
    for index, look in enumerate(LOOKS):
        column = index - (len(LOOKS) - 1) / 2
        subject = add(scene, look.label, bust, Matrix.Translation((column * step, -column * STAGGER, 0.0)))
        skin = materials.create(look.label, SUBSURFACE, **{"Subsurface Radius": MEDIUM.inputs["Subsurface Radius"]} | look.inputs)
        _paint(skin)
        for slot, material in zip(subject.material_slots, (other, eyes, skin), strict=True):
            slot.link = "OBJECT"
            slot.material = material
        heads.append(Head(look, subject))
    _camera(scene, step * len(LOOKS), height, top + MARGIN * height)
    scene.world = uniform_world("Surroundings", SURROUNDINGS)
    lights = (add_sun(scene, "Key", *KEY), add_sun(scene, "Back", *BACK))
    scene.view_layers[0].update()
    regions, diffuse = materials.create_plain("Regions")
    materials.paint(regions, diffuse.inputs["Color"], REGION_ATTRIBUTE, 1.0 / len(REGIONS))
    return Face(scene, tuple(heads), lights, regions)


def _bust(mesh: bpy.types.Mesh, width: float, bottom: float) -> bpy.types.Mesh:
    """Return a copy turned by YAW and cut to `width` [m] and above the height `bottom` [m], so that heads do not overlap.

    It has three slots: hair and clothes, eyes, skin.
    """
    part = bmesh.new()
    part.from_mesh(mesh)
    bmesh.ops.transform(part, matrix=Matrix.Rotation(YAW, 4, "Z"), verts=part.verts)
    for point, normal in (((width / 2, 0, 0), (1, 0, 0)), ((-width / 2, 0, 0), (-1, 0, 0)), ((0, 0, bottom), (0, 0, -1))):
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


def _paint(material: bpy.types.Material, albedo: float = 1.0) -> None:
    """Feed the Color of a material's group with the mesh's paint times `albedo`."""
    (group,) = (node for node in material.node_tree.nodes if node.type == "GROUP")
    materials.paint(material, group.inputs["Color"], ALBEDO_ATTRIBUTE, albedo)


def _camera(scene: bpy.types.Scene, width: float, height: float, top: float) -> None:
    """Add a level orthographic camera that shows at least `width` by `height` [m] below the height `top` [m]."""
    aspect = scene.render.resolution_x / scene.render.resolution_y
    frame_width = max(width, height * aspect)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.sensor_fit, camera.ortho_scale = "ORTHO", "HORIZONTAL", frame_width
    camera.clip_start, camera.clip_end = DISTANCE / 2.0, DISTANCE * 2.0
    position = Matrix.Translation((0.0, -DISTANCE, top - frame_width / aspect / 2.0))
    scene.camera = add(scene, "Camera", camera, position @ Matrix.Rotation(math.pi / 2, 4, "X"))
