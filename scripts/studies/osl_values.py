# SPDX-License-Identifier: GPL-3.0-or-later
"""What shaders/rough_diffuse.osl returns in Cycles, one pixel for each input, and how far its lobes are from the formulas'.

The viewer is an orthographic camera above, so V is VIEWER for every input; N and the parameters come from attributes of the mesh, a
triangle for each input, and each light is a picture of its own. Closures leave no other way to ask for a value.
"""

import math
from array import array
from collections.abc import Sequence
from dataclasses import dataclass

import bpy

from mathutils import Vector as BlenderVector

from true_diffuse.addon.blender.engines import CYCLES
from true_diffuse.addon.blender.osl import compile_osl
from true_diffuse.addon.closures.lobe_error import VIEWS
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.materials import Setting
from true_diffuse.addon.models import MODELS, Model
from true_diffuse.addon.models.quadrature import gauss_legendre
from true_diffuse.addon.models.registry import Osl
from true_diffuse.addon.models.vector import Vector, add, dot, from_polar, normalize, scale
from true_diffuse.scenes.elements import add as add_object
from true_diffuse.scripts.studies import triangles
from true_diffuse.scripts.studies.float32_accuracy import Arguments, single_vector
from true_diffuse.scripts.studies.triangles import VIEWER

EXACT = (Osl.EXACT, Osl.EXACT_TOWARDS_VIEWER)
# Where N has a cosine below STEEP to light or viewer, the mesh faces both halfway: Cycles lights no surface from behind.
STEEP = 0.02
LOBE_SUNS, LOBE_AZIMUTHS = 24, 96  # for `lobe_errors`: about 2000 lights for each view


def drawn() -> list[str]:
    """Return the ids of the models that the shader has, in the order of their numbers."""
    return [model.id for model in MODELS.values() if model.osl is not None]


@dataclass(frozen=True)
class Sun:
    """A sun lamp's direction: the rotation that was asked for, and `towards` it as Blender's matrix has it, in 32-bit floats."""

    rotation: tuple[float, float, float]
    towards: Vector


@dataclass(frozen=True)
class Inputs:
    """What one pixel shows: `model`, one of `drawn`, with all of the shader's parameters, each a 32-bit float.

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
        """The value of the model's parameter, if it has one."""
        return MODELS[self.model].shape({"Roughness": self.roughness, "IOR": self.ior})

    def arguments(self) -> Arguments:
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
    scene, light = bpy.data.scenes.new("True Diffuse Suns"), bpy.data.lights.new("Sun", "SUN")
    lamp = add_object(scene, "Sun", light)
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
    material = create_osl("OSL Measurement", "rough_diffuse")
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
    surfaces = [one.surface() for one in inputs]
    mesh = triangles.triangles([n for n, _ in surfaces], [int(is_turned) for _, is_turned in surfaces])
    for name, values in {
        "Model": [float(MODELS[one.model].number) for one in inputs],
        "Roughness": [one.roughness for one in inputs],
        "IOR": [one.ior for one in inputs],
    }.items():
        triangles.set_attribute(mesh, f"osl_{name}", values, is_vector=False)
    triangles.set_attribute(mesh, "osl_Color", [x for one in inputs for x in (one.albedo,) * 3], is_vector=True)
    triangles.set_attribute(mesh, "osl_Normal", [x for one in inputs for x in one.normal], is_vector=True)
    for material in pair if any(one.turns for one in inputs) else pair[:1]:  # each takes Cycles as long as the picture
        mesh.materials.append(material)
    try:
        return triangles.shade(mesh, sun.rotation, CYCLES, osl=True)
    finally:
        bpy.data.meshes.remove(mesh)


@dataclass(frozen=True)
class Shown:
    """A model of `drawn` as the shader has it, to be held against the formula `exact`."""

    model: str
    exact: Model
    roughness: float = 0.33
    ior: float = 1.5
    albedo: float = 1.0


def lobe_errors(cases: Sequence[Shown]) -> list[float]:
    """Return how far each case is from its formula, as `lobe_error.lobe_error` has it: all from the same few renders.

    With the viewer as the pole, L is a sun's angle from it and the azimuth between the two: the suns lie where Gauss' rule has
    them, and N is turned through the azimuths at which each is above the surface.
    """
    rule = gauss_legendre(LOBE_SUNS)
    lamps = suns([from_polar(cosine, 0.0) for cosine, _ in rule])
    inputs: list[Inputs] = []
    places = []  # case, view and fraction of the solid angle of each input
    for view in VIEWS:
        mu = math.cos(math.radians(view))
        for lamp, (cosine, weight) in zip(lamps, rule, strict=True):
            # N.L = 0 at the azimuth whose cosine this is
            end = -mu * cosine / math.sqrt((1.0 - mu * mu) * (1.0 - cosine * cosine))
            reach = math.acos(max(-1.0, min(1.0, end)))
            for k in range(LOBE_AZIMUTHS if reach > 0.0 else 0):
                n = single_vector(from_polar(mu, reach * (k + 0.5) / LOBE_AZIMUTHS))
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


def create_osl(name: str, stem: str, **inputs: Setting) -> bpy.types.Material:
    """Return a new material whose surface is the OSL shader shaders/STEM.osl, for Cycles scenes with Open Shading Language on.

    Raises RuntimeError with the compiler's messages where it does not compile.
    """
    material = bpy.data.materials.new(name)
    material.node_tree.nodes.clear()
    node = material.node_tree.nodes.new("ShaderNodeScript")
    compile_osl(node, stem)
    materials.show(material, node, inputs)
    return material
