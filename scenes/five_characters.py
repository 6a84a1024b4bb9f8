# SPDX-License-Identifier: GPL-3.0-or-later
"""The paper's figure: one character five times, side by side, from standard specular over Lambert to rough Oren-Nayar."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import bpy

from mathutils import Matrix, Vector

from ..addon.blender import color_spaces
from ..addon.material import materials
from ..addon.models import MODELS, Lambert, Model, OrenNayar, Specular
from ..addon.models.registry import DEFAULT
from ..addon.nodes import ROUGH_DIFFUSE, SPECULAR_GROUP, Group
from . import look_materials
from .elements import add, add_sun, uniform_world
from .look_materials import LookMaterials, Materials
from .subject import ALBEDO_ATTRIBUTE, Figure, points_of

SIGMAS = (0.0, 0.2, 0.33)  # the figure's caption; the paper's text says 0.3 for the last
YAW = math.radians(-22.0)  # characters turn a little away from the key light, so that the shadow side is seen
KEY_DIRECTION = Vector((-0.5, -0.75, 0.5))  # towards the light, from the camera's upper left
KEY_IRRADIANCE = math.pi  # W/m^2: a white Lambert surface that faces the key then has radiance 1
FILL_RADIANCE = 0.16  # of the sky all around [W/(m^2 sr)]
BACKDROP_ALBEDO = 0.12
LENS = 400.0  # mm on a 36 mm frame: long, so that all five are seen from nearly the same side
MARGIN = 0.05  # around the characters, as a fraction of what is shown of one
SHOULDERS = 0.55  # of the figure's height from the crown down: what a bust's width is taken from
# Neighbors of a bust overlap by their arms, the right one in front and out of the left one's shadow; whole figures stand apart.
BUST_STEP, BUST_STAGGER = 0.78, 0.5  # as fractions of a character's width
FIGURE_STEP, FIGURE_STAGGER = 1.06, 0.0
# Characters as they are stand out of each other's shadow, and closer where they are wider than WIDE of their height: by their arms.
AS_IS_STEP, AS_IS_STAGGER = 1.06, 0.35
WIDE, WIDE_STEP, WIDE_STAGGER = 0.75, 0.8, 0.5
WALL = 6.0  # meters behind the middle of the row
LABEL_SIZE = 0.15  # of the font, as a fraction of the distance between two characters: the longest word is 5.6 times as wide
LABEL_RADIANCE = 0.7
UNSEEN_BY_RAYS = ("diffuse", "glossy", "transmission", "volume_scatter", "shadow")


@dataclass(frozen=True)
class CharacterLook:
    """How one character is shaded: a node group with its inputs, and the reflectance model that the group renders."""

    name: str
    label: str
    model: Model
    group: Group
    inputs: dict[str, float | str]


@dataclass(frozen=True)
class Character:
    """One character of the scene: a mesh, or an empty above the parts of a character as it is, with its materials in the look."""

    look: CharacterLook
    subject: bpy.types.Object
    materials: LookMaterials | None = None

    @property
    def parts(self) -> list[bpy.types.Object]:
        """The objects that are seen."""
        return [item for item in (self.subject, *self.subject.children) if item.type == "MESH"]

    def wear(self, materials: Materials) -> None:
        """Give the parts the materials that stand for those of their meshes."""
        for part in self.parts:
            for slot, source in zip(part.material_slots, part.data.materials, strict=True):
                slot.link = "OBJECT"
                slot.material = materials[source]


@dataclass(frozen=True)
class FiveCharacters:
    """The scene and its parts: the characters and the key light.

    Plaster has `plain`, a Diffuse BSDF with the characters' albedo. A character as it is has its materials, `converted` to groups
    of ours, and `notes` on what it lost.
    """

    scene: bpy.types.Scene
    characters: tuple[Character, ...]
    key: bpy.types.Object
    plain: bpy.types.Material | None = None
    converted: Materials | None = None
    notes: tuple[str, ...] = ()


def looks(sigmas: tuple[float, ...] = SIGMAS) -> tuple[CharacterLook, ...]:
    """Return the looks in the paper's order: standard specular, Lambert, then Oren-Nayar for each sigma [radians]."""
    specular = Specular()
    standard = {"Specular": specular.specular, "Exponent": specular.exponent}
    rough = []
    for sigma in sigmas:
        digits = repr(sigma).removesuffix(".0")
        label = f"Oren-Nayar  \u03c3 = {digits}"
        rough.append(CharacterLook(f"oren_nayar_{digits}", label, OrenNayar(sigma), ROUGH_DIFFUSE, {"Roughness": sigma}))
    return (
        CharacterLook("specular", "Standard specular", specular, SPECULAR_GROUP, standard),
        CharacterLook("lambert", "Lambert", Lambert(), ROUGH_DIFFUSE, {"Model": MODELS["lambert"].label}),
        *rough,
    )


def build(
    mesh: bpy.types.Mesh, albedo: float, bust: bool, resolution: tuple[int, int], sigmas: tuple[float, ...] = SIGMAS
) -> FiveCharacters:
    """Return a new scene with `mesh` in each look, its color attribute scaled by `albedo`, framed for `resolution` [pixels].

    With `bust`, heads and shoulders fill the frame's width; without, whole figures are seen.
    """
    scene = _scene(resolution)
    all_looks = looks(sigmas)
    low, high = _bounds(points_of(mesh), bust)
    width = high.x - low.x
    step, stagger = (BUST_STEP * width, BUST_STAGGER * width) if bust else (FIGURE_STEP * width, FIGURE_STAGGER * width)
    row = Row(len(all_looks), low, high, step, stagger, bust)
    characters = []
    for look, place in zip(all_looks, row.places(), strict=True):
        material = materials.create(look.label, look.group, **look.inputs)
        materials.paint(material, material.node_tree.nodes[look.group.name].inputs["Color"], ALBEDO_ATTRIBUTE, albedo)
        subject = add(scene, look.label, mesh, place)
        subject.material_slots[0].link = "OBJECT"
        subject.material_slots[0].material = material
        characters.append(Character(look, subject))
    key = row.surround(scene)
    plain, diffuse = materials.create_plain("Albedo")
    materials.paint(plain, diffuse.inputs["Color"], ALBEDO_ATTRIBUTE, albedo)
    return FiveCharacters(scene, tuple(characters), key, plain)


def build_as_is(figures: Sequence[Figure], resolution: tuple[int, int], sigmas: tuple[float, ...] = SIGMAS) -> FiveCharacters:
    """Return a new scene with a character as it is in each look, framed for `resolution` [pixels].

    `figures` are all that `pose` is to show of it; the first stands, is what the frame is made for, and is shown.
    """
    figure = figures[0]
    scene = _scene(resolution)
    all_looks = looks(sigmas)
    low, high = _bounds(figure.points, False)
    width = high.x - low.x
    step, stagger = (WIDE_STEP, WIDE_STAGGER) if width > WIDE * high.z else (AS_IS_STEP, AS_IS_STAGGER)
    row = Row(len(all_looks), low, high, step * width, stagger * width)
    notes: dict[str, None] = {}
    sources = dict.fromkeys(source for each in figures for source in each.materials)
    converted = look_materials.converted(sources, figure.scale, lambda line: notes.update({line: None}))
    characters = []
    for look, place in zip(all_looks, row.places(), strict=True):
        if look.group is SPECULAR_GROUP:
            worn = look_materials.under_highlight(converted, lambda line: notes.update({line: None}))
        else:
            label = look.inputs.get("Model", MODELS[DEFAULT].label)
            worn = look_materials.in_model(converted, str(label), float(look.inputs.get("Roughness", 0.0)))
        characters.append(Character(look, add(scene, look.label, None, place), worn))
    key = row.surround(scene)
    stage = FiveCharacters(scene, tuple(characters), key, converted=converted, notes=tuple(notes))
    pose(stage, figure)
    return stage


def pose(stage: FiveCharacters, figure: Figure) -> None:
    """Have the characters of `build_as_is` show one of its figures."""
    for character in stage.characters:
        for part in character.parts:
            bpy.data.objects.remove(part)
        for part in figure.parts:
            item = add(stage.scene, part.name, part.mesh)
            item.parent = character.subject
            item.matrix_parent_inverse = part.matrix  # which may shear, as no object's own location, rotation and scale do
        if character.materials:
            character.wear(character.materials.shown)
    stage.scene.view_layers[0].update()


def add_labels(stage: FiveCharacters) -> tuple[bpy.types.Object, ...]:
    """Add the label of each character below its feet, and return them; the picture gets as much higher as they need.

    They hang before the camera above the floor, light up by themselves and neither cast shadows nor light anything.
    """
    scene, places = stage.scene, [character.subject.matrix_world.translation for character in stage.characters]
    camera, size = scene.camera, LABEL_SIZE * (places[1].x - places[0].x)
    eye = camera.matrix_world.translation
    top = -MARGIN * eye.z  # seen at the characters' distance, as are the following
    low = top - 3.0 * size  # two lines, and a margin of one
    share = 0.97 * eye.z / (eye.z - low)  # of the way to a character: there the label's lower end is just above the floor
    width = -eye.y * 36.0 / LENS
    pixel = width / scene.render.resolution_x
    missing = eye.z + camera.data.shift_y * width - pixel * scene.render.resolution_y / 2.0 - low
    rows = max(0, math.ceil(missing / pixel))
    scene.render.resolution_y += rows
    camera.data.shift_y -= rows * pixel / width / 2.0
    camera.data.clip_start = min(camera.data.clip_start, 0.9 * share * -eye.y)
    material = bpy.data.materials.new("Label")
    material.diffuse_color = (LABEL_RADIANCE, LABEL_RADIANCE, LABEL_RADIANCE, 1.0)
    nodes = material.node_tree.nodes
    nodes.clear()
    glow = nodes.new("ShaderNodeEmission")
    glow.inputs["Color"].default_value = material.diffuse_color
    output = nodes.new("ShaderNodeOutputMaterial")
    material.node_tree.links.new(glow.outputs[0], output.inputs["Surface"])
    labels = []
    for character, place in zip(stage.characters, places, strict=True):
        text = bpy.data.curves.new(f"Label {character.look.label}", "FONT")
        text.body = "\n".join(character.look.label.split(maxsplit=1))
        text.size, text.align_x, text.align_y = size * share, "CENTER", "TOP"
        text.materials.append(material)
        point = eye + share * (Vector((place.x * eye.y / (eye.y - place.y), 0.0, top)) - eye)  # all in one line
        label = add(scene, text.name, text, Matrix.Translation(point) @ Matrix.Rotation(math.pi / 2, 4, "X"))
        for kind in UNSEEN_BY_RAYS:
            setattr(label, f"visible_{kind}", False)
        label.hide_select = True
        labels.append(label)
    return tuple(labels)


def _scene(resolution: tuple[int, int]) -> bpy.types.Scene:
    scene = bpy.data.scenes.new("True Diffuse Five Characters")
    scene.render.resolution_x, scene.render.resolution_y = resolution
    color_spaces.show_plainly(scene)
    scene.cycles.max_bounces = 4
    return scene


@dataclass(frozen=True)
class Row:
    """A row of characters turned by YAW, of the extent `low` to `high` [m] each, `step` apart, each `stagger` in front of the last.

    With `bust`, their upper parts fill the frame.
    """

    count: int
    low: Vector
    high: Vector
    step: float
    stagger: float
    bust: bool = False

    @property
    def width(self) -> float:
        """The width of all [m]."""
        return self.step * (self.count - 1) + (self.high.x - self.low.x)

    def places(self) -> Iterator[Matrix]:
        """Yield what places each of the characters."""
        for index in range(self.count):
            column = index - (self.count - 1) / 2
            centered = Matrix.Translation((column * self.step - (self.low.x + self.high.x) / 2, -column * self.stagger, 0.0))
            yield centered @ Matrix.Rotation(YAW, 4, "Z")

    def surround(self, scene: bpy.types.Scene) -> bpy.types.Object:
        """Add camera, backdrop, sky and key light; return the latter."""
        _camera(scene, self.width, self.high.z, self.bust)
        behind = self.high.y + self.stagger * (self.count - 1) / 2
        _backdrop(scene, max(WALL, behind + 1.0))
        scene.world = uniform_world("Fill", strength=FILL_RADIANCE)
        key = add_sun(scene, "Key", KEY_DIRECTION, KEY_IRRADIANCE)
        scene.view_layers[0].update()
        return key


def _bounds(points: Iterable[Vector], bust: bool) -> tuple[Vector, Vector]:
    """Return the lowest and highest corner [m] of one character turned by YAW; with `bust`, of its upper part."""
    turned = [Matrix.Rotation(YAW, 3, "Z") @ point for point in points]
    top = max(point.z for point in turned)
    seen = [point for point in turned if point.z >= top * (1.0 - SHOULDERS)] if bust else turned
    return (
        Vector((min(p.x for p in seen), min(p.y for p in seen), min(p.z for p in seen))),
        Vector((max(p.x for p in seen), max(p.y for p in seen), top)),
    )


def _camera(scene: bpy.types.Scene, width: float, top: float, bust: bool) -> None:
    """Add a level camera that frames `width` [m]: with `bust` up to a little above `top` [m], else everything from 0 to `top`.

    For busts it is at the height of the crowns with the lens shifted down, so that heads at different depths form one row.
    """
    aspect = scene.render.resolution_x / scene.render.resolution_y
    frame_width = width * (1.0 + MARGIN)
    if not bust:
        frame_width = max(frame_width, top * (1.0 + 2.0 * MARGIN) * aspect)
    frame_height = frame_width / aspect
    middle = top + MARGIN * min(top, frame_height) - frame_height / 2.0 if bust else top / 2.0
    camera = bpy.data.cameras.new("Camera")
    camera.lens, camera.sensor_width, camera.sensor_fit = LENS, 36.0, "HORIZONTAL"
    distance = frame_width * LENS / 36.0
    camera.clip_start, camera.clip_end = distance / 2.0, distance * 10.0  # tight: EEVEE resolves depth by their ratio
    height = top if bust else middle
    camera.shift_y = (middle - height) / frame_width
    scene.camera = add(scene, "Camera", camera, Matrix.Translation((0.0, -distance, height)) @ Matrix.Rotation(math.pi / 2, 4, "X"))


def _backdrop(scene: bpy.types.Scene, far: float) -> None:
    """Add the gray floor that the characters stand on and the wall behind them, at y = `far` [m]."""
    material, node = materials.create_plain("Backdrop")
    node.inputs["Color"].default_value = material.diffuse_color = (BACKDROP_ALBEDO, BACKDROP_ALBEDO, BACKDROP_ALBEDO, 1.0)
    size = 1000.0  # meters: beyond every camera
    floor = [(-size, -size, 0.0), (size, -size, 0.0), (size, far, 0.0), (-size, far, 0.0)]
    wall_top = [(size, far, size), (-size, far, size)]
    mesh = bpy.data.meshes.new("Backdrop")
    mesh.from_pydata(floor + wall_top, [], [(0, 1, 2, 3), (3, 2, 4, 5)])
    mesh.materials.append(material)
    add(scene, "Backdrop", mesh)
