# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime shader calls for each model: functions of shaders/STEM.glsl. No bpy."""

import functools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

from ..blender.glsl import own_text
from ..models.registry import MODELS, ReflectanceModel

type Constants = tuple[float, ...]
type Numbers = Mapping[str, float]
"""A model's parameter by the name of its socket."""


@dataclass(frozen=True)
class GlslModel:
    """A model in GLSL: `radiance` is an expression of n, l, v and albedo, `ambient` one of mu and albedo.

    `surface` are statements ahead of all lights, whose variables `radiance` may use; it, too, is of n, v and albedo. All may use
    `shape`, a float or vector of the up to four numbers that `constants` returns for a parameter, and the GLSL function
    `coefficients` for one that varies over the surface. `ambient` needs shaders/`ambient_stem`.glsl, which is the model's own where
    that is empty. `more` are functions beside those of the files. `base` is the model without a highlight, None where it has none.
    The variables of its `surface` are there, too.
    """

    stem: str
    surface: str
    radiance: str
    ambient: str
    constants: Callable[[Numbers], Constants]
    coefficients: str = ""
    ambient_stem: str = ""
    more: str = ""
    base: "GlslModel | None" = None


@functools.cache
def glsl_model(model: ReflectanceModel) -> GlslModel:
    """Return a registered model in GLSL; ValueError where its file does not declare its functions."""
    stem = model.id
    declared = re.search(rf"(\w+) {stem}_surface\(", own_text(stem))
    if declared is None:
        raise ValueError(f"{stem}.glsl declares no {stem}_surface")
    shape = ", inputs.shape" if model.parameter else ""
    return GlslModel(
        stem,
        f"{declared[1]} surface = {stem}_surface(n, v, albedo{shape});",
        f"{stem}_radiance(surface, l)",
        f"{stem}_albedo(mu, albedo{shape})",
        lambda inputs: model.reference(inputs).constants,
        f"{stem}_coefficients" if model.parameter else "",
        model.glsl.albedo_stem,
    )


def with_highlight(model: GlslModel) -> GlslModel:
    """Return a model with Blinn-Phong's highlight of `inputs.highlight_weight` and `inputs.highlight_exponent` over it."""
    numbers = "inputs.highlight_weight, inputs.highlight_exponent"
    if model is LAMBERT:
        return replace(
            model,
            stem="blinn_phong",
            base=model,
            surface=f"{model.surface} BlinnPhongSurface highlight = blinn_phong_surface(n, v, albedo, {numbers});",
            radiance="blinn_phong_radiance(highlight, l)",  # with Lambert's law in it; what nothing uses is not compiled
            ambient=f"blinn_phong_albedo(mu, albedo, {numbers})",
            ambient_stem="directional_albedo",
        )
    return replace(
        model,
        base=model,
        surface=f"{model.surface} BlinnPhongSurface highlight = blinn_phong_surface(n, v, vec3(0.0), {numbers});",
        radiance=f"{model.radiance} + blinn_phong_radiance(highlight, l)",
        ambient_stem="directional_albedo",
        ambient=f"{model.ambient} + blinn_phong_albedo(mu, vec3(0.0), {numbers})",
    )


LAMBERT = glsl_model(MODELS["lambert"])
SPECULAR = with_highlight(LAMBERT)
