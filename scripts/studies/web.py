# SPDX-License-Identifier: GPL-3.0-or-later
"""The accuracy of each reflectance model in a glTF file, drawn by web engines: a sphere, the human, and a character with textures.

What is drawn is held against the model, with the position, normal and base color that the engine itself has in each pixel; its base
color is that of a file of Lambert's model, as other models' files have another, to be nearer to them.
"""

import json
import math
import struct
from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any

import bpy

import true_diffuse
from true_diffuse.addon.blender import report
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.surface import texture_factor
from true_diffuse.addon.measure import error
from true_diffuse.addon.measure.record import Record, known
from true_diffuse.addon.models import MODELS, Eon, Formula, Lambert, Model, ReflectanceModel
from true_diffuse.addon.models.geometry import clamp
from true_diffuse.addon.models.registry import IOR
from true_diffuse.addon.nodes import ROUGH_DIFFUSE
from true_diffuse.scenes.elements import add
from true_diffuse.scenes.look_materials import converted, in_model
from true_diffuse.scenes.sphere import COLOR, sphere_under_sun
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters import character
from true_diffuse.scripts.characters.small.characters import GLTF_FILES
from true_diffuse.scripts.studies.rough import QUICK_SIGMAS, SIGMAS
from true_diffuse.scripts.studies.study import Step, Table, percent, pivot, text
from true_diffuse.scripts.web.engines import ALBEDO, NORMAL, POSITION, RADIANCE, Camera, Engine, Sun, Triple

PAPER, EON, LAMBERT = (MODELS[key] for key in ("oren_nayar", "eon", "lambert"))
EXTENSION = "KHR_materials_diffuse_roughness"
SIZE, CHARACTER_SIZE = 96, 160  # pixels
DARK = (0.05, 0.05, 0.05, 1.0)


def _sun(degrees: float) -> Sun:
    """Return a sun of irradiance pi, so far to the right of a viewer who looks along +Y."""
    angle = math.radians(degrees)
    return Sun((math.sin(angle), -math.cos(angle), 0.0), (math.pi, math.pi, math.pi))


LIGHTS: Mapping[str, Sequence[Sun]] = {
    **{f"{degrees}\u00b0": (_sun(degrees),) for degrees in (0, 60, 120)},
    "three": (
        Sun((0.6, -0.64, 0.48), (3.0, 2.9, 2.7)),
        Sun((-0.8, -0.6, 0.0), (0.3, 0.5, 0.9)),
        Sun((0.28, 0.96, 0.0), (6.0, 4.0, 2.0)),
    ),
}
ON_SPHERE = Camera(SIZE, (0.0, -8.0, 0.0), (0.0, 0.0, 0.0), 2.0 * math.degrees(math.atan(18.0 / 125.0)), 1.0, 20.0)
ON_CHARACTER = Camera(CHARACTER_SIZE, (0.0, -6.0, 1.2), (0.0, 0.0, 0.9), 18.0, 1.0, 20.0)

type Worn = Mapping[bpy.types.Material | None, bpy.types.Material]


@dataclass(frozen=True)
class Case:
    """A reflectance model and its roughness; of a sphere also its color."""

    model: ReflectanceModel
    sigma: float
    color: tuple[float, float, float, float] = COLOR

    @property
    def formula(self) -> Formula:
        """Its formula."""
        return self.model.reference({"Roughness": self.sigma, "IOR": IOR.usual})


class Subject:
    """What is exported: `parts`, in the materials that `wear` returns for a case in place of those of their meshes."""

    def __init__(self, name: str, camera: Camera, parts: Sequence[bpy.types.Object], wear: Callable[[Case], Worn]) -> None:
        self.name = name
        self.camera = camera
        self._parts = parts
        self._wear = wear

    def export(self, case: Case, path: Path) -> None:
        """Write a .glb file of it."""
        worn = self._wear(case)
        for item in bpy.context.scene.objects:
            item.select_set(item in self._parts)
        for part in self._parts:
            for slot, source in zip(part.material_slots, part.data.materials, strict=True):
                slot.link, slot.material = "OBJECT", worn[source]
        bpy.ops.export_scene.gltf(filepath=str(path), use_selection=True)
        report.take()


def sphere() -> Subject:
    """Return the sphere in the color of the case."""
    item = sphere_under_sun(SIZE).sphere

    def wear(case: Case) -> Worn:
        inputs = {"Model": case.model.label, "Color": case.color, "Roughness": case.sigma}
        return {item.data.materials[0]: materials.create("Sphere", ROUGH_DIFFUSE, **inputs)}

    return Subject("sphere", ON_SPHERE, [item], wear)


def human() -> Subject:
    """Return the human, whose colors are an attribute of its mesh."""
    item = add(bpy.context.scene, "Human", character.load("human"))

    def wear(case: Case) -> Worn:
        material = materials.create("Human", ROUGH_DIFFUSE, Model=case.model.label, Roughness=case.sigma)
        tree = material.node_tree
        color = tree.nodes.new("ShaderNodeVertexColor")
        color.layer_name = ALBEDO_ATTRIBUTE
        tree.links.new(color.outputs["Color"], tree.nodes[ROUGH_DIFFUSE.name].inputs["Color"])
        return {None: material}

    return Subject("human", ON_CHARACTER, [item], wear)


def textured(folder: Path) -> Subject:
    """Return a small character as it is, without specular layers: images times a color, and a color. `folder` gets its file."""
    path = folder / "tint_times_image.glb"
    path.write_bytes(GLTF_FILES[path.name]())
    figure = character.load_figures(path, (None,), lambda _: None)[None]
    own = converted(figure.materials, figure.scale, lambda _: None)
    parts = [add(bpy.context.scene, part.name, part.mesh, part.matrix) for part in figure.parts]
    return Subject(path.stem, ON_CHARACTER, parts, lambda case: in_model(own, case.model.label, case.sigma).measured)


def enable_export() -> None:
    """Have Blender's glTF exporter ask this extension about materials, whose settings of scenes are registered."""
    bpy.context.preferences.addons.new().module = true_diffuse.__name__


def cases(quick: bool) -> list[Case]:
    """Return the models and roughnesses of the sphere."""
    if quick:
        return [Case(PAPER, sigma) for sigma in QUICK_SIGMAS]
    every = [Case(model, sigma) for model in MODELS.values() for sigma in (SIGMAS if model.is_rough else SIGMAS[:1])]
    return [*every, Case(EON, 1.0, DARK)]


def steps(engines: Sequence[Engine], folder: Path, quick: bool) -> list[Step]:
    """Return a step for each subject, case and engine; files are written to `folder`."""
    on_characters = [Case(each, sigma) for each in (PAPER, EON) for sigma in SIGMAS]
    characters = [] if quick else [textured(folder), human()]  # the former first: its file is imported beside what is there
    subjects = {sphere(): cases(quick), **dict.fromkeys(characters, on_characters)}
    return [
        Step(f"{engine.name}  {subject.name}  {case.model.label}  {case.sigma:g}", partial(measure, subject, case, engine, folder))
        for subject, own in subjects.items()
        for case, engine in product(own, engines)
    ]


def measure(subject: Subject, case: Case, engine: Engine, folder: Path) -> Iterator[Record]:
    """Yield, for each of LIGHTS, the error of what the engine draws, that of the nearest EON, and that of Lambert in its place.

    The nearest EON is the formula, with what the file says. Lambert has the model's average albedo, all that a file without
    KHR_materials_diffuse_roughness can say. Raises WebError.
    """
    path, lambert, before = (folder / f"{name}.glb" for name in ("model", "lambert", "before"))
    subject.export(replace(case, model=LAMBERT), lambert)
    subject.export(case, path)
    before.write_bytes(as_lambert(lambert.read_bytes(), case.formula))
    engine.load(lambert, subject.camera)
    found = surface(engine)
    engine.load(before, subject.camera)
    drawn_before = {name: engine.draw(RADIANCE, suns)[0] for name, suns in LIGHTS.items()}
    engine.load(path, subject.camera)
    roughness = roughness_of(path.read_bytes())
    in_file = replace(found, albedo=engine.draw(ALBEDO)[0])
    for name, suns in LIGHTS.items():
        expected, plain = analytic(found, [case.formula, Lambert()], subject.camera.eye, suns)
        (nearest,) = analytic(in_file, [Eon(roughness)], subject.camera.eye, suns)
        pictures = {
            "rms_error": engine.draw(RADIANCE, suns)[0],
            "nearest_error": picture(nearest, len(found.measurable)),
            "before_error": drawn_before[name],
        }
        yield {
            "engine": engine.name,
            "subject": subject.name,
            "model": case.model.label,
            "sigma": case.sigma if case.model.is_rough else None,
            "color": case.color[:3],
            "light": name,
            "pixels": len(expected.pixels),
            "eon_roughness": roughness,
            **{key: known(error.errors(rgb, expected, plain).rms) for key, rgb in pictures.items()},
        }


def surface(engine: Engine) -> error.GBuffer:
    """Return the geometry and the base color in each pixel that the engine draws: pixels have one sample, in their middle."""
    (position, shown), (normal, _), (albedo, _) = (engine.draw(what) for what in (POSITION, NORMAL, ALBEDO))
    return error.GBuffer(normal, position, albedo, shown)


def analytic(surface: error.GBuffer, models: Sequence[Model], eye: Triple, suns: Sequence[Sun]) -> list[error.Analytic]:
    """Return the radiance of each of `models` under all `suns` together, in the pixels that face the point `eye` [m] and a sun."""
    sums = [array("d", bytes(8 * len(surface.albedo))) for _ in models]
    lit = set()
    for sun in suns:
        found = error.analytic(surface, models, eye, error.Light(sun.direction, 1.0))
        lit.update(found[0].pixels)
        for total, one in zip(sums, found, strict=True):
            for k, pixel in enumerate(one.pixels):
                for channel, irradiance in enumerate(sun.irradiance):
                    total[3 * pixel + channel] += irradiance * one.radiance[3 * k + channel]
    pixels = array("l", sorted(lit))
    return [error.Analytic(pixels, array("f", (total[3 * i + c] for i in pixels for c in range(3)))) for total in sums]


def picture(radiance: error.Analytic, pixels: int) -> array[float]:
    """Return the linear RGB of so many pixels, black but for those of `radiance`."""
    result = array("f", bytes(12 * pixels))
    for k, pixel in enumerate(radiance.pixels):
        result[3 * pixel : 3 * pixel + 3] = radiance.radiance[3 * k : 3 * k + 3]
    return result


def roughness_of(content: bytes) -> float:
    """Return the factor of KHR_materials_diffuse_roughness that all materials of a .glb file have, 0 without the extension."""
    (factor,) = {
        material.get("extensions", {}).get(EXTENSION, {}).get("diffuseRoughnessFactor", 0.0)
        for material in _document(content)["materials"]
    }
    return factor


def as_lambert(content: bytes, formula: Formula) -> bytes:
    """Return the .glb file of Lambert's model, `content`, with the average albedo of `formula` in each base color.

    Textures and colors of vertices can only be scaled.
    """
    document = _document(content)
    colored = {
        primitive["material"]
        for mesh in document["meshes"]
        for primitive in mesh["primitives"]
        if "COLOR_0" in primitive["attributes"]
    }
    for index, material in enumerate(document["materials"]):
        base = material["pbrMetallicRoughness"]
        *rgb, alpha = base.get("baseColorFactor", (1.0, 1.0, 1.0, 1.0))
        if index in colored or "baseColorTexture" in base:
            rgb = [channel * texture_factor(formula.average_albedo) for channel in rgb]
        else:
            rgb = map(formula.average_albedo, rgb)
        base["baseColorFactor"] = [*(clamp(channel, 0.0, 1.0) for channel in rgb), alpha]
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + content[20 + struct.unpack_from("<I", content, 12)[0] :]
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def _document(content: bytes) -> dict[str, Any]:
    """Return the JSON of a .glb file."""
    return json.loads(content[20 : 20 + struct.unpack_from("<I", content, 12)[0]])


def table(found: Sequence[Record]) -> Table:
    """Return a row for each subject, model and roughness, its errors in % under LIGHTS in this order."""
    first = found[0]["engine"]
    cells = [
        {**one, "title": title, "figure": one[key]}
        for one in found
        for title, key in (("Before", "before_error"), ("Nearest EON", "nearest_error"), (one["engine"], "rms_error"))
        if title == one["engine"] or one["engine"] == first
    ]

    def row(one: Record) -> tuple[str, ...]:
        dark = f", albedo {one['color'][0]:g}" if one["color"] == DARK[:3] else ""
        return one["subject"], f"{one['model']} {text(one['sigma'])}{dark}", text(one["eon_roughness"], ".3f")

    def cell(shared: list[Record]) -> str:
        return " / ".join(percent(one["figure"]) for one in shared)

    return pivot(cells, ("Subject", "Model", "EON"), row, lambda one: one["title"], cell)
