# SPDX-License-Identifier: GPL-3.0-or-later
"""The page of one character: everything in one file, which asks for no other."""

import json
from array import array
from dataclasses import replace
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from mathutils import Matrix

from true_diffuse.addon.blender import glsl
from true_diffuse.addon.models import Lambert, OrenNayar, Specular
from true_diffuse.addon.models.color import LUMINANCE
from true_diffuse.addon.models.registry import by_formula
from true_diffuse.scenes.five_characters import (
    BACKDROP_ALBEDO,
    FILL_RADIANCE,
    KEY_DIRECTION,
    KEY_IRRADIANCE,
    MARGIN,
    YAW,
    Character,
    CharacterLook,
    FiveCharacters,
)
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.studies import pictures
from true_diffuse.scripts.viewer.albedo import Baked, baked
from true_diffuse.scripts.viewer.geometry import Piece, pack

HERE = Path(__file__).parent
VERSION = "#version 300 es\nprecision highp float;\nprecision highp int;\n"
AXES = Matrix(((1.0, 0.0, 0.0), (0.0, 0.0, 1.0), (0.0, -1.0, 0.0)))  # x right, y up, z to the viewer, of Blender's
PIVOT = 0.25  # of what is shown, from the top down: the chin of a bust
MODELS = (Specular, Lambert, OrenNayar)  # in the order of surface_fragment.glsl


def html(stage: FiveCharacters, name: str, albedo: float) -> tuple[str, list[str]]:
    """Return the page of the characters of `stage`, by the name of whom they show, and lines on what it lacks.

    `albedo` is that of plaster's lightest paint.
    """
    places = [character.subject.matrix_world.translation.x for character in stage.characters]
    beside = Matrix.Translation((sum(places) / len(places), 0.0, 0.0))  # of the row's middle, where a view's is
    place = AXES.to_4x4() @ beside @ Matrix.Rotation(YAW, 4, "Z")
    shown = Baked([plaster(stage.characters[0], albedo)], lost=[]) if stage.plain else baked(stage)
    mesh = pack([replace(piece, matrix=place @ piece.matrix) for piece in shown.pieces])
    data = {
        "looks": [_look(character.look) for character in stage.characters],
        "light": list(AXES @ KEY_DIRECTION.normalized()),
        "irradiance": KEY_IRRADIANCE,
        "sky": FILL_RADIANCE,
        "background": BACKDROP_ALBEDO,
        "eon": _nearest_eon(),
        "frame": _frame(stage, mesh["high"][0] - mesh["low"][0], mesh["high"][1]),
        "scale": {
            "colors": pictures.DIVERGING,
            "knee": pictures.SCALE_KNEE,
            "marks": [[mark, pictures.scale_place(mark)] for mark in pictures.SCALE_MARKS],
            "not_measured": pictures.NOT_MEASURED,
            "luminance": LUMINANCE,
        },
        "shaders": {name: [_shader(f"{name}_vertex"), _shader(f"{name}_fragment")] for name in ("surface", "shadow")},
        "mesh": mesh,
        "images": shown.images,
    }
    page = Template(_text("page.html")).substitute(
        title=escape(f"The paper's characters: {name}"),
        style=_text("page.css"),
        script=_text("viewer.js"),
        data=json.dumps(data, allow_nan=False).replace("<", "\\u003c"),  # which could end the element
    )
    return page, shown.lost


def plaster(character: Character, albedo: float) -> Piece:
    """Return the mesh of a character of plaster, in its paint times `albedo`."""
    mesh = character.subject.data
    paint = array("f", bytes(16 * len(mesh.vertices)))
    mesh.attributes[ALBEDO_ATTRIBUTE].data.foreach_get("color", paint)
    corners = array("i", bytes(4 * len(mesh.loops)))
    mesh.loops.foreach_get("vertex_index", corners)
    return Piece(mesh, Matrix(), colors=[albedo * value for k in corners for value in paint[4 * k : 4 * k + 3]])


def _look(look: CharacterLook) -> dict[str, Any]:
    model = look.model
    values = {"sigma": model.sigma} if isinstance(model, OrenNayar) else {}
    if isinstance(model, Specular):
        values = {"highlight": [model.specular, model.exponent]}
    return {"label": look.label, "model": MODELS.index(type(model)), **values}


def _nearest_eon() -> dict[str, Any]:
    """Return what gives the EON that glTF carries in place of Oren-Nayar: polynomials in sigma^2, and B's part in the albedo."""
    nearest, model = by_formula(OrenNayar(1.0)).eon, OrenNayar(1.0)
    assert nearest.is_even
    return {"above": nearest.above, "below": nearest.below, "b_average": (model.average_albedo(1.0) - model.a) / model.b}


def _frame(stage: FiveCharacters, widest: float, highest: float) -> dict[str, float]:
    """Return how much a view shows at least, up to `top`, what it is turned around, and how far its camera is, all in m.

    As in the picture, but for the space around a character that is `widest` m wide and `highest` m high.
    """
    settings, camera = stage.scene.render, stage.scene.camera
    _, y, z = camera.location
    width = -y * camera.data.sensor_width / camera.data.lens
    height = width * settings.resolution_y / settings.resolution_x
    top = z + camera.data.shift_y * width + height / 2.0
    if top <= height:  # a whole figure
        height, top = highest * (1.0 + 2.0 * MARGIN), highest * (1.0 + MARGIN)
    shown = min(width / len(stage.characters), widest * (1.0 + MARGIN))
    return {"width": shown, "height": height, "top": top, "pivot": top - PIVOT * height, "far": -y}


def _shader(name: str) -> str:
    models = glsl.source("blinn_phong", "lambert", "oren_nayar", "directional_albedo") if name == "surface_fragment" else ""
    return VERSION + models + _text(f"{name}.glsl")


def _text(name: str) -> str:
    return (HERE / name).read_text(encoding="utf-8")
