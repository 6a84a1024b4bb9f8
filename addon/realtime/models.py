# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime shader calls for each model: functions of shaders/STEM.glsl, with what depends on the material alone folded.

No bpy.
"""

import functools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..blender.glsl import own_text
from ..models.registry import MODELS, ReflectanceModel

type Constants = tuple[float, ...]
type Numbers = Mapping[str, float]
"""A group's sockets by name."""


@dataclass(frozen=True)
class GlslModel:
    """A model in GLSL: `radiance` is an expression of n, l, v and albedo, `ambient` one of mu and albedo.

    `surface` are statements ahead of all lights, whose variables `radiance` may use; it, too, is of n, v and albedo. All may use
    material.shape, a vec4 of the up to four numbers that `constants` returns. `ambient` needs shaders/`ambient_stem`.glsl, which is
    the model's own where that is empty. `more` are functions beside those of the files.
    """

    stem: str
    surface: str
    radiance: str
    ambient: str
    constants: Callable[[Numbers], Constants]
    ambient_stem: str = ""
    more: str = ""


def _model(stem: str, ambient_stem: str, constants: Callable[[Numbers], Constants], *shape: str) -> GlslModel:
    """Return the model of shaders/STEM.glsl, whose functions get the components `shape` of material.shape."""
    declared = re.search(rf"(\w+) {stem}_surface\(", own_text(stem))
    if declared is None:
        raise ValueError(f"{stem}.glsl declares no {stem}_surface")
    folded = "".join(f", material.shape.{components}" for components in shape)
    surface = f"{declared[1]} surface = {stem}_surface(n, v, albedo{folded});"
    ambient = f"{stem}_albedo(mu, albedo{folded})"
    return GlslModel(stem, surface, f"{stem}_radiance(surface, l)", ambient, constants, ambient_stem)


@functools.cache
def glsl_model(model: ReflectanceModel) -> GlslModel:
    """Return a registered model in GLSL; ValueError where its file does not declare its functions."""
    usual = model.formula(*([model.parameter.usual] if model.parameter else []))
    shape = "xyzw"[: len(usual.constants)]
    return _model(model.id, model.glsl.albedo_stem, lambda inputs: model.reference(inputs).constants, *filter(None, [shape]))


LAMBERT = glsl_model(MODELS["lambert"])
SPECULAR = _model("blinn_phong", "directional_albedo", lambda inputs: (inputs["Specular"], inputs["Exponent"]), "x", "y")
