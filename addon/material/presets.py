# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials to pick by name: the measured media and tones of skin, as values of the group Subsurface, and matte materials.

Media and skin are known under a surface that sends light back inside, which the group's closures lack: see
closures/subsurface_fit.py. A preset is the medium without such a surface that has the same color and in which light travels as far.

- Color: the fraction of the light that entered the object which leaves it, without specular reflection. For media it is the
  diffuse reflectance R_d that H. W. Jensen and others print beside their coefficients, for skin that of `models/skin.py`. Without
  the boundary the same coefficients would be much too light: 0.57 for 0.44 in the red of Skin 1.
- Subsurface Radius: the mean free path with which the diffuse mean free path 1 / sigma_tr is the medium's, as that is how far light
  travels under a boundary. It is 1 to 2.1 times the measured 1 / sigma_t', with which a shadow's edge would be too sharp.
- Subsurface Radius of skin: light that the epidermis sends back stays near, the more so the darker it is. Hence the geometric mean
  of the lengths that the dermis would have at the skin's color and at that without melanin: a rule of thumb, too long for the
  little green and blue that deep skin reflects.

The coat's IOR is that of the coefficients' source. Its weight and roughness are chosen by eye: nobody measured them.

Matte materials are Oren-Nayar's model in the group Rough Diffuse. Its colors and sigmas are by eye; the moon's color is that of its
geometric albedo, 0.12, a little redder than the sun's light.
"""

import math
import operator
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from ..closures.subsurface_fit import BEAM
from ..models.dipole import StandardDipole
from ..models.medium import MEDIA, Channel, Medium
from ..models.skin import ETA, TONES, Rgb, Skin
from ..nodes import ROUGH_DIFFUSE, SUBSURFACE, Group

PICTURES = Path(__file__).resolve().parents[1] / "previews"
LEAST_ABSORPTION = 1e-6  # mm^-1; stands for an absorption too small to measure, so that light has an end (Spectralon: R_d 0.999)
ROUGHNESS = 0.2  # sigma of the surface, where an artist lowers Subsurface
SKIN_COAT = (1.0, 0.45)
# Specular, Specular Roughness
COATS = {
    "Apple": (0.5, 0.4),
    "Chicken 1": (1.0, 0.3),
    "Chicken 2": (1.0, 0.3),
    "Cream": (1.0, 0.15),
    "Ketchup": (1.0, 0.15),
    "Marble": (1.0, 0.2),
    "Potato": (0.3, 0.5),
    "Skim milk": (1.0, 0.1),
    "Skin 1": SKIN_COAT,
    "Skin 2": SKIN_COAT,
    "Spectralon": (0.0, 0.5),
    "Whole milk": (1.0, 0.1),
}
# Name: description, Color, Roughness (sigma [radians])
ROUGH: dict[str, tuple[str, Rgb, float]] = {
    "Chalk": ("White chalk", (0.86, 0.85, 0.82), 0.4),
    "Clay": ("Fired clay, unglazed", (0.52, 0.24, 0.13), 0.6),
    "Plaster": ("Wall plaster", (0.80, 0.78, 0.73), 0.5),
    "Felt": ("Green felt; the light that single fibers let through at the rim is not in it", (0.04, 0.21, 0.11), 0.75),
    "Moon": ("The moon's dust, between its seas and highlands", (0.135, 0.12, 0.105), 0.75),
}

EXAMPLES: dict[str, dict[str, float | tuple[float, ...]]] = {  # inputs of groups whose defaults look like any white surface
    "principled": {"Base Color": (0.1, 0.25, 0.6, 1.0), "Diffuse Roughness": 0.5, "Coat Weight": 1.0},
    "specular": {"Color": (0.35, 0.05, 0.05, 1.0), "Specular": 0.3, "Exponent": 40.0},
}


@dataclass(frozen=True)
class Preset:
    """A material of `group`: `inputs` by socket name, lengths in mm. `key` is stable; `kind` is its menu's label."""

    key: str
    name: str
    kind: str
    description: str
    group: Group
    inputs: Mapping[str, float | tuple[float, ...]]

    @property
    def picture(self) -> Path:
        return picture(self.key)


def picture(key: str) -> Path:
    """Return the path of the picture of the preset or group `key`, rendered by scripts/release/previews.py."""
    return PICTURES / f"{key}.webp"


def _preset(
    name: str, kind: str, description: str, color: Rgb, mean_free_path: Rgb, ior: float, coat: tuple[float, float]
) -> Preset:
    inputs = {
        "Color": (*color, 1.0),
        "Subsurface Radius": mean_free_path,
        "IOR": ior,
        "Specular": coat[0],
        "Specular Roughness": coat[1],
        "Roughness": ROUGHNESS,
        "Subsurface": 1.0,
    }
    return Preset(_key(name), name, kind, description, SUBSURFACE, inputs)


def _key(name: str) -> str:
    return name.lower().replace(" ", "_")


def _mean_free_path(color: float, diffuse_mean_free_path: float) -> float:
    """Return 1 / sigma_t' = sqrt(3 (1 - alpha')) / sigma_tr [mm] of the medium without a boundary that reflects `color`."""
    return math.sqrt(3.0) * BEAM.s(color) * diffuse_mean_free_path


def _of_medium(medium: Medium) -> Preset:
    channels = [Channel(channel.sigma_s_prime, max(channel.sigma_a, LEAST_ABSORPTION)) for channel in medium.channels]
    red, green, blue = (StandardDipole(channel, medium.eta).reflectance for channel in channels)
    color = red, green, blue
    red, green, blue = map(_mean_free_path, color, (channel.diffuse_mean_free_path for channel in channels))
    measured = " / ".join(f"{length:.2g}" for length in medium.mean_free_path)
    description = (
        f"{medium.name}, measured: 1 / sigma_t' = {measured} mm. H. W. Jensen and others, A Practical Model for Subsurface Light "
        "Transport (2001)"
    )
    return _preset(medium.name.title(), "Translucent", description, color, (red, green, blue), medium.eta, COATS[medium.name])


def _of_tone(tone: str, skin: Skin) -> Preset:
    tinted = map(_mean_free_path, skin.albedo, skin.diffuse_mean_free_path)
    clear = map(_mean_free_path, Skin(0.0, skin.blood).albedo, skin.diffuse_mean_free_path)
    red, green, blue = map(math.sqrt, map(operator.mul, tinted, clear))
    description = (
        f"Skin with {100.0 * skin.melanosomes:.2g} % melanosomes in the epidermis and {100.0 * skin.blood:.2g} % blood in the "
        "dermis. S. L. Jacques, Skin Optics (1998) and Optical Properties of Biological Tissues: A Review (2013)"
    )
    return _preset(f"{tone} Skin", "Skin", description, skin.albedo, (red, green, blue), ETA, SKIN_COAT)


def _rough(name: str, material: str, color: Rgb, sigma: float) -> Preset:
    description = f"{material}. Oren-Nayar with sigma = {sigma:g}; color and sigma are by eye"
    inputs = {"Color": (*color, 1.0), "Roughness": sigma}
    return Preset(_key(name), name, "Matte", description, ROUGH_DIFFUSE, inputs)


_all = (
    *(_of_tone(tone, skin) for tone, skin in TONES.items()),
    *map(_of_medium, MEDIA),
    *(_rough(name, *values) for name, values in ROUGH.items()),
)
PRESETS = {preset.key: preset for preset in _all}
