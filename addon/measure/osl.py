# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaders/rough_diffuse.osl returns in Cycles, one pixel for each input, and how near that comes to the formulas.

The viewer is an orthographic camera above, so V is VIEWER for every input; N and the parameters come from attributes of the mesh, a
triangle for each input, and each light is a picture of its own. Closures leave no other way to ask for a value.

Asked of every input: an error of at most RELATIVE of the value where that is above FLOOR of the model's largest, and at most
ABSOLUTE elsewhere; and never NaN, infinity or a negative radiance. An input is conditioned if moving its numbers by their last bit
(in 32-bit floats) moves the exact value by as much as the error: there the shader is as good as its input.
"""

import math
import random
import struct
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import bpy

from mathutils import Vector as BlenderVector

from .. import engines, materials
from ..models import Model
from ..models.quadrature import gauss_legendre
from ..models.vector import Vector, add, dot, from_polar, normalize, scale
from . import render
from .lobe_error import VIEWS

if TYPE_CHECKING:
    from ..comparison import Progress, Record

MODELS = ("lambert", "oren_nayar", "fujii", "eon", "cycles_diffuse", "oren_nayar_1994", "wolff", "pits")  # as Model counts them
EXACT = ("lambert", "oren_nayar", "fujii", "eon", "cycles_diffuse")  # Oren-Nayar where s >= 0
VIEWER: Vector = (0.0, 0.0, 1.0)
RELATIVE, FLOOR, ABSOLUTE = 2e-5, 1e-4, 1e-6
EXAMINED = 100  # of the random inputs, so many of the worst, and as many others, are worked out in all digits
COUNT, SUNS = 100_000, 12
RENDER_WORK = 8  # as long as so many models take
# Where N has a cosine below STEEP to light or viewer, the mesh faces both halfway: Cycles lights no surface from behind.
STEEP = 0.02
LOBE_SUNS, LOBE_AZIMUTHS = 24, 96  # for `lobe_errors`: about 2000 lights for each view
SMALLEST = 4  # pixels, the least that Blender renders
HALF = 0.45  # of a pixel: how far each triangle reaches

type Referee = Callable[[str, Vector, Vector, Vector, float, Sequence[float]], float]


@dataclass(frozen=True)
class Sun:
    """A sun lamp's direction: the rotation that was asked for, and `towards` it as Blender's matrix has it, in 32-bit floats."""

    rotation: tuple[float, float, float]
    towards: Vector


@dataclass(frozen=True)
class Inputs:
    """What one pixel shows: `model` of MODELS with all of the shader's parameters, each a 32-bit float.

    `normal` is the shader's Normal, `n` the normal of the mesh if that must differ, as where Normal has no direction. A mesh that
    `turns` where N is steep goes without Cycles' shadowing of the ramps.
    """

    model: str
    sun: Sun
    normal: Vector
    albedo: float = 0.7
    roughness: float = 0.33
    ior: float = 1.5
    n: Vector | None = None
    turns: bool = True

    @property
    def shape(self) -> tuple[float, ...]:
        """The parameters that the model has beside the albedo."""
        return () if self.model in ("lambert", "pits") else (self.ior,) if self.model == "wolff" else (self.roughness,)

    def arguments(self) -> tuple[Vector, Vector, Vector, float, tuple[float, ...]]:
        """Return what the formula gets."""
        return self.n or self.normal, self.sun.towards, VIEWER, self.albedo, self.shape

    def surface(self) -> tuple[Vector, bool]:
        """Return the unit normal of the mesh, and whether it is not N but faces light and viewer, as N hardly does."""
        n, l = normalize(self.n or self.normal), normalize(self.sun.towards)
        if not self.turns or min(dot(n, l), dot(n, VIEWER)) > STEEP:
            return n, False
        half = add(l, VIEWER)
        return normalize(half if math.hypot(*half) > 0.1 * STEEP else add(n, scale(VIEWER, STEEP))), True


def suns(aims: Sequence[Vector]) -> list[Sun]:
    """Return suns in about these directions."""
    light = bpy.data.lights.new("Sun", "SUN")
    lamp = bpy.data.objects.new("Sun", light)
    scene = bpy.data.scenes.new("True Diffuse Suns")
    scene.collection.objects.link(lamp)
    result = []
    for aim in aims:
        lamp.rotation_euler = BlenderVector(aim).to_track_quat("Z", "Y").to_euler()
        scene.view_layers[0].update()
        x, y, z = lamp.matrix_world.col[2].xyz
        result.append(Sun(tuple(lamp.rotation_euler), (x, y, z)))
    bpy.data.scenes.remove(scene)
    bpy.data.lights.remove(light)
    return result


def evaluate(inputs: Sequence[Inputs]) -> list[tuple[float, float, float]]:
    """Return the red, green and blue radiance of each input for a sun of irradiance 1 W/m^2. Renders once for each sun in them."""
    groups: dict[Sun, list[int]] = {}
    for index, one in enumerate(inputs):
        groups.setdefault(one.sun, []).append(index)
    result = [(0.0, 0.0, 0.0)] * len(inputs)
    pair = [_material(correction) for correction in (True, False)]
    for sun, indices in groups.items():
        rgb = _render(sun, [inputs[index] for index in indices], pair)
        for place, index in enumerate(indices):
            result[index] = (rgb[3 * place], rgb[3 * place + 1], rgb[3 * place + 2])
    for material in pair:
        bpy.data.materials.remove(material)
    return result


def _material(correction: bool) -> bpy.types.Material:
    """Return the shader with every parameter fed by the mesh attribute of its name.

    Where the mesh is not turned as N is, Cycles' `correction` would shadow what N faces.
    """
    material = materials.create_osl("OSL Measurement", "rough_diffuse")
    material.cycles.use_bump_map_correction = correction
    tree = material.node_tree
    script = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeScript")
    for socket in script.inputs:
        attribute = tree.nodes.new("ShaderNodeAttribute")
        attribute.attribute_name = f"osl_{socket.name}"
        tree.links.new(attribute.outputs["Vector" if socket.name in ("Color", "Normal") else "Fac"], socket)
    return material


def _render(sun: Sun, inputs: Sequence[Inputs], pair: Sequence[bpy.types.Material]) -> array[float]:
    """Return the pixels of all inputs under one sun, one after the other; the second material is for a mesh that is not as N."""
    width = max(SMALLEST, math.ceil(math.sqrt(len(inputs))))
    height = max(SMALLEST, math.ceil(len(inputs) / width))
    mesh = _mesh([*inputs, *[inputs[-1]] * (width * height - len(inputs))], width)
    for material in pair if any(one.turns for one in inputs) else pair[:1]:  # each takes Cycles as long as the picture
        mesh.materials.append(material)
    subject = bpy.data.objects.new("OSL Measurement", mesh)
    light = bpy.data.lights.new("OSL Measurement", "SUN")
    light.energy = 1.0
    lamp = bpy.data.objects.new("OSL Measurement", light)
    lamp.rotation_euler = sun.rotation
    lens = bpy.data.cameras.new("OSL Measurement")
    lens.type, lens.ortho_scale, lens.clip_end = "ORTHO", max(width, height), 4000.0
    camera = bpy.data.objects.new("OSL Measurement", lens)
    camera.location = (0.5 * width, 0.5 * height, 2000.0)
    source = bpy.data.scenes.new("OSL Measurement")
    for item in (subject, lamp, camera):
        source.collection.objects.link(item)
    source.camera = camera
    source.render.resolution_x, source.render.resolution_y = width, height
    source.cycles.shading_system = True
    source.view_layers[0].update()
    try:
        with render.measurement_scene(source, subject, lamp) as scene:
            rows = render.radiance(scene, engines.CYCLES, 1)[1]
    finally:
        for data, group in ((source, "scenes"), (mesh, "meshes"), (light, "lights"), (lens, "cameras")):
            getattr(bpy.data, group).remove(data)
    # rows come from the top
    return array("f", [value for row in reversed(range(height)) for value in rows[3 * width * row : 3 * width * (row + 1)]])


def _mesh(inputs: Sequence[Inputs], width: int) -> bpy.types.Mesh:
    """Return a triangle for each input around the middle of its pixel, tilted to its normal, with the parameters as attributes."""
    places, turned = array("f"), array("i")
    for index, one in enumerate(inputs):
        n, is_turned = one.surface()
        turned.append(is_turned)
        for x, y in ((-HALF, -HALF), (HALF, -HALF), (0.0, HALF)):
            places.extend((index % width + 0.5 + x, index // width + 0.5 + y, -(n[0] * x + n[1] * y) / n[2]))
    count = len(inputs)
    mesh = bpy.data.meshes.new("OSL Measurement")
    mesh.vertices.add(3 * count)
    mesh.vertices.foreach_set("co", places)
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", range(3 * count))
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", range(0, 3 * count, 3))
    mesh.polygons.foreach_set("material_index", turned)
    mesh.shade_flat()  # Cycles rounds the normals of smooth shading to 1e-5
    mesh.update(calc_edges=True)
    numbers = {
        "Model": [float(MODELS.index(one.model)) for one in inputs],
        "Roughness": [one.roughness for one in inputs],
        "IOR": [one.ior for one in inputs],
    }
    vectors = {"Color": [x for one in inputs for x in (one.albedo,) * 3], "Normal": [x for one in inputs for x in one.normal]}
    for name, values in numbers.items():
        mesh.attributes.new(f"osl_{name}", "FLOAT", "FACE").data.foreach_set("value", array("f", values))
    for name, values in vectors.items():
        mesh.attributes.new(f"osl_{name}", "FLOAT_VECTOR", "FACE").data.foreach_set("vector", array("f", values))
    return mesh


@dataclass(frozen=True)
class Shown:
    """A model of MODELS as the shader has it, to be held against the formula `exact`."""

    model: str
    exact: Model
    roughness: float = 0.33
    ior: float = 1.5
    albedo: float = 1.0


def lobe_error(model: str, exact: Model, roughness: float = 0.33, ior: float = 1.5, albedo: float = 1.0) -> float:
    """Return how far the shader's `model` is from `exact` over all lights and views, as `lobe_error.lobe_error` has it."""
    return lobe_errors([Shown(model, exact, roughness, ior, albedo)])[0]


def lobe_errors(cases: Sequence[Shown]) -> list[float]:
    """Return the lobe error of each case, from the same few renders.

    With the viewer as the pole, L is a sun's angle from it and the azimuth between the two: the suns lie where Gauss' rule has
    them, and N is turned through the azimuths at which each is above the surface.
    """
    rule = gauss_legendre(LOBE_SUNS)
    lamps = suns([from_polar(cosine, 0.0) for cosine, _ in rule])
    inputs: list[Inputs] = []
    places = []  # case, view and share of the solid angle of each input
    for view in VIEWS:
        mu = math.cos(math.radians(view))
        for lamp, (cosine, weight) in zip(lamps, rule, strict=True):
            # N.L = 0 at the azimuth whose cosine this is
            end = -mu * cosine / math.sqrt((1.0 - mu * mu) * (1.0 - cosine * cosine))
            reach = math.acos(max(-1.0, min(1.0, end)))
            for k in range(LOBE_AZIMUTHS if reach > 0.0 else 0):
                n = _vector(from_polar(mu, reach * (k + 0.5) / LOBE_AZIMUTHS))
                for index, case in enumerate(cases):
                    inputs.append(Inputs(case.model, lamp, n, case.albedo, case.roughness, case.ior, turns=False))
                    places.append((index, view, weight * reach))
    squares = {(index, view): [0.0, 0.0] for index in range(len(cases)) for view in VIEWS}  # of the error and of the formula
    for one, (index, view, share), (value, _, _) in zip(inputs, places, evaluate(inputs), strict=True):
        expected = cases[index].exact.radiance(one.normal, one.sun.towards, VIEWER, one.albedo)
        squares[index, view][0] += share * (value - expected) ** 2
        squares[index, view][1] += share * expected * expected
    ratios = {key: math.sqrt(error / whole) for key, (error, whole) in squares.items()}
    return [sum(ratios[index, view] for view in VIEWS) / len(VIEWS) for index in range(len(cases))]


def stability(exact: Referee, quick: Referee, count: int, progress: "Progress") -> "Iterator[Record]":
    """Yield a record for each model and family of cases: its worst input, and how many inputs do as asked.

    `exact` gives a formula's value in all digits, `quick` in 64-bit floats. Every random input is held against `quick`, the worst
    of them and all other inputs against `exact`; `screen_error` is how far the two are apart at most, as a multiple of the error
    allowed. All random inputs are of EXACT, `count` of each, and of Wolff's model, whose error is that of its ramp; the other
    families are of all models, of which those not in EXACT are only asked to be sound. The work is `work` to `progress`.
    """
    with progress.step("OSL", RENDER_WORK):
        families = _cases(count)
        got = iter(evaluate([one for family in families.values() for one in family]))
    for model in MODELS:
        with progress.step(f"OSL  {model}", 1.0):
            records = _records(model, {case: family for (of, case), family in families.items() if of == model}, got, exact, quick)
        yield from records


def work() -> int:
    """Return how many units of work `stability` has."""
    return RENDER_WORK + len(MODELS)


@dataclass(frozen=True)
class Result:
    """The shader's value for `inputs` and the formula's; `allowed` is the error that is asked for."""

    inputs: Inputs
    got: tuple[float, float, float]
    expected: float
    allowed: float

    @property
    def error(self) -> float:
        """The largest deviation of a channel; infinite if one is not finite."""
        return max(abs(value - self.expected) if math.isfinite(value) else math.inf for value in self.got)

    @property
    def excess(self) -> float:
        """The error as a multiple of what is asked for."""
        return self.error / self.allowed


def _records(
    model: str,
    families: dict[str, list[Inputs]],
    got: Iterator[tuple[float, float, float]],
    exact: Referee,
    quick: Referee,
) -> "list[Record]":
    screened = [float(quick(model, *one.arguments())) for one in families.get("random", ())]
    largest = max(screened, default=1.0 / math.pi)

    def judge(inputs: Inputs, value: tuple[float, float, float], expected: float) -> Result:
        return Result(inputs, value, expected, RELATIVE * expected if expected > FLOOR * largest else ABSOLUTE)

    def truth(inputs: Inputs) -> float:
        return float(exact(model, *inputs.arguments()))

    records = []
    for case, family in families.items():
        screen_error = 0.0
        if case == "random":
            values = [next(got) for _ in family]
            results = sorted(map(judge, family, values, screened), key=lambda result: -result.excess)
            for k in [*range(min(EXAMINED, len(results))), *range(EXAMINED, len(results), len(results) // EXAMINED + 1)]:
                corrected = judge(results[k].inputs, results[k].got, truth(results[k].inputs))
                screen_error = max(screen_error, abs(corrected.expected - results[k].expected) / corrected.allowed)
                results[k] = corrected
        else:
            results = [judge(one, next(got), truth(one)) for one in family]
        records.append(_record(model, case, results, largest, screen_error, exact))
    return records


def _record(model: str, case: str, results: Sequence[Result], largest: float, screen_error: float, exact: Referee) -> "Record":
    worst = max(results, key=lambda result: result.excess)
    outside = sorted((result for result in results if not result.excess <= 1.0), key=lambda result: -result.excess)
    names = ("albedo", *(() if not worst.inputs.shape else ("ior",) if model == "wolff" else ("roughness",)))
    n, l, v, albedo, shape = worst.inputs.arguments()
    relative = max((r.error / r.expected for r in results if r.expected > FLOOR * largest), default=0.0)
    absolute = max((r.error for r in results if not r.expected > FLOOR * largest), default=0.0)
    error, relative, absolute = _plain((worst.error, relative, absolute))
    return {
        "home": "osl",
        "model": model,
        "case": case,
        "inputs": {"n": _plain(n), "l": _plain(l), "v": _plain(v)} | dict(zip(names, _plain((albedo, *shape)), strict=True)),
        "expected": worst.expected,
        "got": _plain(worst.got),
        "error": error,
        "allowed": worst.allowed,
        "uncertainty": _uncertainty(worst.inputs, worst.expected, exact),
        "finite": all(0.0 <= value < math.inf for result in results for value in result.got),
        "count": len(results),
        "relative_error": relative,
        "absolute_error": absolute,
        "share_within": 1.0 - len(outside) / len(results),
        "outside": len(outside),
        "conditioned": sum(r.error <= _uncertainty(r.inputs, r.expected, exact) for r in outside[:EXAMINED]),
        "screen_error": screen_error,
    }


def _uncertainty(inputs: Inputs, expected: float, exact: Referee) -> float:
    """Return how far the exact value moves, to first order, when each number of the inputs moves by its last bit the worse way."""
    n, l, v, albedo, shape = inputs.arguments()
    numbers, total = (*n, *l, *v, albedo, *shape), 0.0
    for k, x in enumerate(numbers):
        if math.isfinite(x):
            step = math.ldexp(1.0, max(math.frexp(x)[1] - 24, -149))
            moves = []
            for neighbor in (x - step, x + step):
                moved = (*numbers[:k], neighbor, *numbers[k + 1 :])
                vectors = (_vector(moved[start : start + 3]) for start in (0, 3, 6))
                moves.append(abs(float(exact(inputs.model, *vectors, moved[9], moved[10:])) - expected))
            total += max(moves)
    return total


def _plain(values: Sequence[float]) -> list[float | str]:
    """Return the numbers, or their names where JSON has no number for them."""
    return [x if math.isfinite(x) else str(x) for x in values]


def _single(*values: float) -> tuple[float, ...]:
    """Round to 32-bit floats, so that both sides start from the same numbers."""
    form = f"{len(values)}f"
    return struct.unpack(form, struct.pack(form, *values))


def _vector(values: Sequence[float]) -> Vector:
    x, y, z = _single(*values)
    return x, y, z


def _anywhere(dice: random.Random) -> Vector:
    return normalize((dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0), dice.gauss(0.0, 1.0)))


def _between(sun: Sun, mu_i: float, mu_o: float) -> Vector | None:
    """Return the normal with these cosines to the sun and the viewer; None where there is none."""
    l = normalize(sun.towards)
    c, across = dot(l, VIEWER), (l[1], -l[0], 0.0)  # L x V
    rest = 1.0 - c * c
    if rest < 1e-12:
        return None
    a, b = (mu_i - c * mu_o) / rest, (mu_o - c * mu_i) / rest
    left = (1.0 - a * mu_i - b * mu_o) / rest
    if left < -1e-9:
        return None
    return normalize(add(add(scale(l, a), scale(VIEWER, b)), scale(across, math.sqrt(max(0.0, left)))))


def _cases(count: int) -> dict[tuple[str, str], list[Inputs]]:
    """Return the inputs by model and family: random ones, and those that are hard or wrong."""
    dice = random.Random(1)
    somewhere = suns([_anywhere(dice) for _ in range(SUNS)])
    ahead, aside, behind, *usual = suns(
        [VIEWER, (1.0, 0.0, 0.0), (0.01, 0.0, -1.0), (0.6, 0.0, 0.8), (0.96, 0.0, -0.28)],
    )

    lit = []
    while len(lit) < count:
        sun, n = somewhere[len(lit) * SUNS // count], _vector(_anywhere(dice))
        if dot(n, sun.towards) > 0.0 and n[2] > 0.0:
            lit.append((sun, n))

    cosines = (0.0, 1e-8, 1e-4, 0.5, 0.8, 1.0 - 1e-8, 1.0)
    grazing = []
    for sun, mu_i, mu_o in product((aside, behind, *usual, *somewhere), cosines, cosines):
        n = _between(sun, mu_i, mu_o)
        if n is not None:
            grazing.append((sun, _vector(n)))
    below = [(sun, _vector(n)) for sun in (aside, *usual) for mu in (-0.5, -1e-8) if (n := _between(sun, mu, 0.5)) is not None]
    # light and viewer at the normal, light at the viewer, light and viewer at either side of the normal
    aligned = [(ahead, VIEWER), *((ahead, _vector(normalize((x, 0.3 * x, 1.0)))) for x in (1e-7, 1e-3, 0.5, 2.0, 1e3, 1e7))]
    aligned += [(sun, _vector(normalize(add(normalize(sun.towards), VIEWER)))) for sun in (aside, *usual, *somewhere)]
    aligned += [(sun, n) for sun in usual for n in (VIEWER, sun.towards) if dot(n, sun.towards) > 0.0 and n[2] > 0.0]

    strange = _single(0.0, 1e-40, 1e-8, 1e-6, 1e-5, 1e-3, 1.0, math.pi / 2, 1e3, math.inf, -1.0, -math.inf, math.nan)
    albedos = _single(0.0, 1e-40, 1e-3, 1.0, 1.5, 1e3, math.inf, -1.0, -math.inf, math.nan)
    faces = [(usual[0], _vector(normalize(n))) for n in ((0.3, 0.2, 1.0), (0.5, 0.1, 0.1), (0.0, 0.5, 0.6), (0.8, -0.3, 0.6))]
    wrong = [(0.0, 0.0, 0.0), (math.nan,) * 3, (math.inf, 0.0, 0.0), (math.nan, 0.0, 1.0), (0.0, 0.0, -math.inf)]
    lengths = _single(1e-6, 1e-3, 0.5, 2.0, 1e3, 1e6)

    rho, roughness, ior = _single(0.7, 0.33, 1.5)
    families: dict[tuple[str, str], list[Inputs]] = {}
    for model in MODELS:
        typical = Inputs(model, ahead, VIEWER, rho, roughness, ior)

        def at(places: Sequence[tuple[Sun, Vector]], typical: Inputs = typical) -> list[Inputs]:
            chosen = places if typical.model != "oren_nayar" else [place for place in places if _towards_viewer(*place)]
            return [replace(typical, sun=sun, normal=n) for sun, n in chosen]

        if model in EXACT or model == "wolff":
            families[model, "random"] = [
                replace(one, albedo=a, roughness=r, ior=n)
                for one in at(lit)
                for a, r, n in [_single(dice.random(), dice.random(), dice.uniform(1.0, 3.0))]
            ]
        families[model, "grazing"] = at(grazing)
        families[model, "light below"] = at(below)
        families[model, "aligned"] = at(aligned)
        families[model, "albedo"] = [replace(one, albedo=x) for one in at(faces) for x in albedos]
        families[model, "shape"] = [replace(one, roughness=x, ior=x) for one in at(faces) for x in strange]
        families[model, "normal"] = [
            replace(one, normal=_vector(scale(one.normal, x)), n=one.normal) for one in at(faces) for x in lengths
        ]
        families[model, "no normal"] = [replace(typical, sun=usual[0], normal=n, n=VIEWER) for n in wrong]
    return families


def _towards_viewer(sun: Sun, n: Vector) -> bool:
    """Return whether s is so far above 0 that the ramps of Oren-Nayar are 0."""
    n, l = normalize(n), normalize(sun.towards)
    side = add(VIEWER, scale(n, -dot(n, VIEWER)))
    return dot(side, l) >= 0.01 * math.hypot(*side) * dot(n, l)
