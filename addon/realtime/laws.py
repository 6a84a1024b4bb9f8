# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime shader calls for each model: functions of shaders/STEM.glsl, with what depends on the material alone folded.

No bpy.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

from ..models import Eon, Fujii, OrenNayar, OrenNayar1994
from ..models.eon import fujii_directional_albedo

type Folded = tuple[float, ...]
type Numbers = Mapping[str, float]
"""A group's sockets by name."""


@dataclass(frozen=True)
class Law:
    """A model in GLSL: `radiance` is an expression of n, l, v and albedo, `ambient` one of mu and albedo.

    `surface` are statements ahead of all lamps, whose variables `radiance` may use; it, too, is of n, v and albedo. All may use
    material.shape, a vec4 of the up to four numbers that `fold` returns. `more` are functions beside those of shaders/STEM.glsl.
    """

    stem: str
    surface: str
    radiance: str
    ambient: str
    fold: Callable[[Numbers], Folded]
    more: str = ""


def _nothing(_inputs: Numbers) -> Folded:
    return ()


def _oren_nayar(inputs: Numbers) -> Folded:
    model = OrenNayar(inputs["Roughness"])
    return model.a, model.b


def _oren_nayar_1994(inputs: Numbers) -> Folded:
    model = OrenNayar1994(inputs["Roughness"])
    return model.a, model.b, model.interreflection


def _fujii(inputs: Numbers) -> Folded:
    model = Fujii(inputs["Roughness"])
    return fujii_directional_albedo(model.roughness, 1.0), model.roughness  # head on it is A


def _eon(inputs: Numbers) -> Folded:
    model = Eon(inputs["Roughness"])
    return *_fujii(inputs), 1.0 - model.average


def _wolff(inputs: Numbers) -> Folded:
    n = min(max(1.0, inputs["IOR"]), 3.0)
    return n * n, (n - 1.0) * (n + 1.0)


def _specular(inputs: Numbers) -> Folded:
    return inputs["Specular"], inputs["Exponent"]


def _law(kind: str, stem: str, fold: Callable[[Numbers], Folded], *shape: str) -> Law:
    """Return the law of shaders/STEM.glsl; `kind`: the struct that STEM_surface returns."""
    folded = "".join(f", material.shape.{part}" for part in shape)
    surface = f"{kind} surface = {stem}_surface(n, v, albedo{folded});"
    ambient = "diffuse_albedo(albedo)" if stem == "lambert" else f"{stem}_albedo(mu, albedo{folded})"
    return Law(stem, surface, f"{stem}_radiance(surface, l)", ambient, fold)


LAMBERT = _law("LambertSurface", "lambert", _nothing)
SPECULAR = _law("BlinnPhongSurface", "blinn_phong", _specular, "x", "y")
LAWS: Mapping[str, Law] = {  # by the entries of the menu Model
    "Lambert": LAMBERT,
    "Oren-Nayar": _law("OrenNayarSurface", "oren_nayar", _oren_nayar, "xy"),
    "Fujii": _law("FujiiSurface", "fujii", _fujii, "xy"),
    "EON": _law("EonSurface", "eon", _eon, "xyz"),
    "Cycles Diffuse": _law("EonSurface", "cycles_diffuse", _eon, "xyz"),
    "Oren-Nayar 1994": _law("OrenNayar1994Surface", "oren_nayar_1994", _oren_nayar_1994, "xyz"),
    "Wolff": _law("WolffSurface", "wolff", _wolff, "xy"),
    "Pitted (Koenderink)": _law("PitsSurface", "pits", _nothing),
}
