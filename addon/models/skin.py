# SPDX-License-Identifier: GPL-3.0-or-later
"""Skin from what colors it, melanin over a dermis with blood, from 400 to 700 nm: its color in linear sRGB and its lengths.

Coefficients [1/cm, wavelength in nm]: S. L. Jacques, "Skin Optics" (Oregon Medical Laser Center News, January 1998):

    melanosomes         mu_a = 6.6e11 nm^-3.33          their fraction of the epidermis: 1.3 to 6.3 % in light skin, 11 to 16 % in
                                                         moderately and 18 to 43 % in darkly pigmented skin; epidermis 60 um thick
    bloodless tissue    mu_a = 0.244 + 85.3 exp(-(nm - 154) / 66.2)
    blood               0.2 % of the dermis on average; mu_a = ln(10) e 150 / 64500, with 150 g/l of hemoglobin of 64500 g/mol

e [1/(cm mol/l)] is S. Prahl's tabulation "Optical Absorption of Hemoglobin" (Oregon Medical Laser Center, 1999, data of
W. B. Gratzer and N. Kollias). Scattering: S. L. Jacques, "Optical properties of biological tissues: a review" (Phys. Med. Biol. 58,
2013), table 1, mean of skin: mu_s' = 46 (nm / 500)^-1.421. Index 1.4, usual in that literature.

Dermis and epidermis as half-spaces reflect albedo.diffuse_albedo_fit of their albedo, R_d and R_e. The epidermis, of thickness X,
lies on the dermis as a layer of P. Kubelka and F. Munk (1931), written without hyperbolic functions, under a surface that sends
back the fraction F of the light inside, as J. L. Saunderson has it (JOSA 32, 1942):

    R = (1 - F) L / (1 - F L),   L = (R_e + D) / (1 + R_e D),   D = e^(-2 kappa X) (R_d - R_e) / (1 - R_d R_e)
    kappa = 2 mu_a (1 + R_e) / (1 - R_e)

What the surface mirrors is left out: that is the specular layer's. F is that of light alike in all directions inside; against
random walks at index 1.4 this makes a half-space 2 % too bright at an albedo of 0.99, and 13 % at 0.9.
"""

import math
from dataclasses import dataclass
from functools import cached_property

from .fresnel import passing
from .geometry import clamp
from .half_space import diffuse_albedo_fit
from .medium import Channel

type Rgb = tuple[float, float, float]

ETA = 1.4
EPIDERMIS = 0.06  # mm
OXYGENATION = 0.75  # of the hemoglobin, between arteries and veins
WAVELENGTHS = range(400, 701, 10)  # nm
# e of hemoglobin with oxygen and without [1/(cm mol/l)], at WAVELENGTHS
OXYGENATED = (
    *(266232.0, 466840.0, 480360.0, 246072.0, 102580.0, 62816.0, 44480.0, 33209.2, 26629.2, 23684.4, 20932.8),
    *(20035.2, 24202.4, 39956.8, 53236.0, 43016.0, 32613.2, 44496.0, 50104.0, 14400.8, 3200.0),
    *(1506.0, 942.0, 610.0, 442.0, 368.0, 319.6, 294.0, 277.6, 276.0, 290.0),
)
DEOXYGENATED = (
    *(223296.0, 303956.0, 407560.0, 528600.0, 413280.0, 103292.0, 23388.8, 16156.4, 14550.0, 16684.0, 20862.0),
    *(25773.6, 31589.6, 39036.4, 46592.0, 53412.0, 53788.0, 45072.0, 37020.0, 28324.4, 14677.2),
    *(9443.6, 6509.6, 5148.8, 4345.2, 3750.12, 3226.56, 2795.12, 2407.92, 2051.96, 1794.28),
)


def melanosome_absorption(nm: float) -> float:
    """Return the absorption inside melanosomes [mm^-1] at the wavelength `nm`."""
    return 0.1 * 6.6e11 * nm**-3.33


def tissue_absorption(nm: float) -> float:
    """Return the absorption of tissue without melanin and blood [mm^-1] at the wavelength `nm`."""
    return 0.1 * (0.244 + 85.3 * math.exp(-(nm - 154.0) / 66.2))


def tissue_scattering(nm: float) -> float:
    """Return mu_s' of skin [mm^-1] at the wavelength `nm`."""
    return 0.1 * 46.0 * (nm / 500.0) ** -1.421


def blood_absorption(oxygenated: float, deoxygenated: float) -> float:
    """Return the absorption of whole blood [mm^-1] from both e [1/(cm mol/l)]."""
    mean = OXYGENATION * oxygenated + (1.0 - OXYGENATION) * deoxygenated
    return 0.1 * math.log(10.0) * mean * 150.0 / 64500.0


def sensitivity(nm: float) -> Rgb:
    """Return what an equal-energy light at the wavelength `nm` adds to linear sRGB red, green and blue, up to a common factor.

    The CIE 1931 observer by C. Wyman, P.-P. Sloan and P. Shirley, "Simple Analytic Approximations to the CIE XYZ Color Matching
    Functions" (JCGT 2(2), 2013), and the matrix of IEC 61966-2-1.
    """

    def bump(center: float, below: float, above: float) -> float:
        return math.exp(-0.5 * ((nm - center) * (below if nm < center else above)) ** 2)

    x = 0.362 * bump(442.0, 0.0624, 0.0374) + 1.056 * bump(599.8, 0.0264, 0.0323) - 0.065 * bump(501.1, 0.0490, 0.0382)
    y = 0.821 * bump(568.8, 0.0213, 0.0247) + 0.286 * bump(530.9, 0.0613, 0.0322)
    z = 1.217 * bump(437.0, 0.0845, 0.0278) + 0.681 * bump(459.0, 0.0385, 0.0725)
    return (
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    )


SENSITIVITY = tuple(sensitivity(nm) for nm in WAVELENGTHS)


def _mean(spectrum: list[float], weights: list[float]) -> float:
    return sum(value * weight for value, weight in zip(spectrum, weights, strict=True)) / sum(weights)


@dataclass(frozen=True)
class Skin:
    """`melanosomes` is their fraction of the epidermis' volume, `blood` its fraction of the dermis; clamped to [0, 1], NaN to 0."""

    melanosomes: float
    blood: float = 0.002

    def __post_init__(self) -> None:
        """Clamp both."""
        object.__setattr__(self, "melanosomes", clamp(self.melanosomes, 0.0, 1.0))
        object.__setattr__(self, "blood", clamp(self.blood, 0.0, 1.0))

    def dermis(self, nm: float, hemoglobin: tuple[float, float]) -> Channel:
        """Return the dermis' coefficients at the wavelength `nm`; `hemoglobin` has both e there."""
        absorption = self.blood * blood_absorption(*hemoglobin) + (1.0 - self.blood) * tissue_absorption(nm)
        return Channel(tissue_scattering(nm), absorption)

    def epidermis(self, nm: float) -> Channel:
        """Return the epidermis' coefficients at the wavelength `nm`."""
        share = self.melanosomes
        return Channel(tissue_scattering(nm), share * melanosome_absorption(nm) + (1.0 - share) * tissue_absorption(nm))

    def reflectance(self, nm: float, hemoglobin: tuple[float, float]) -> float:
        """Return the fraction of the light that entered at the wavelength `nm` that comes out again, R above; in [0, 1]."""
        layer, inside = self.epidermis(nm), 1.0 - passing(ETA).flux
        below, thick = diffuse_albedo_fit(self.dermis(nm, hemoglobin).albedo), diffuse_albedo_fit(layer.albedo)
        kappa = 2.0 * layer.sigma_a * (1.0 + thick) / (1.0 - thick)
        reached = math.exp(-2.0 * kappa * EPIDERMIS) * (below - thick) / (1.0 - below * thick)
        both = (thick + reached) / (1.0 + thick * reached)
        return (1.0 - inside) * both / (1.0 - inside * both)

    @cached_property
    def albedo(self) -> Rgb:
        """The color in linear sRGB: the fraction reflected per channel, of which white has 1, under light of equal energy."""
        spectrum = [self.reflectance(nm, e) for nm, e in _hemoglobin()]
        r, g, b = (_mean(spectrum, [weights[k] for weights in SENSITIVITY]) for k in range(3))
        return r, g, b

    @cached_property
    def mean_free_path(self) -> Rgb:
        """1 / sigma_t' of the dermis per channel [mm]: the mean over the wavelengths that add to it."""
        return self._lengths([self.dermis(nm, e).mean_free_path for nm, e in _hemoglobin()])

    @cached_property
    def diffuse_mean_free_path(self) -> Rgb:
        """1 / sigma_tr of the dermis per channel [mm]: the mean over the wavelengths that add to it."""
        return self._lengths([self.dermis(nm, e).diffuse_mean_free_path for nm, e in _hemoglobin()])

    def _lengths(self, spectrum: list[float]) -> Rgb:
        r, g, b = (_mean(spectrum, [max(0.0, weights[k]) for weights in SENSITIVITY]) for k in range(3))
        return r, g, b


def _hemoglobin() -> list[tuple[int, tuple[float, float]]]:
    """Return (wavelength [nm], both e) of each wavelength."""
    return list(zip(WAVELENGTHS, zip(OXYGENATED, DEOXYGENATED, strict=True), strict=True))


# Melanin within the ranges above. Blood five times the mean of the whole dermis: chosen, for the redness of a face.
TONES = {
    "Fair": Skin(0.013, 0.01),
    "Light": Skin(0.03, 0.01),
    "Medium": Skin(0.06, 0.01),
    "Tan": Skin(0.11, 0.01),
    "Brown": Skin(0.16, 0.01),
    "Deep": Skin(0.22, 0.01),
}
