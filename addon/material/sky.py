# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's Sky Texture as plain values: the air that it shows, and its sun. No bpy.

Single scattering is T. Nishita et al., "Display of the Earth Taking into Account Atmospheric Scattering" (1993), at 21 wavelengths.
Multiple scattering is F. García Liñán's sky of four wavelengths (https://fgarlin.com/posts/2024-12-06-spectral_sky, 2024).
Constants and steps are those of Blender 5.2 (intern/sky/source, intern/cycles/kernel/svm/sky.h). What the air scatters is computed
on the graphics driver (`realtime/sky.py`), as Cycles does ahead of rendering, in tables of the same texels.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from ..models.vector import dot
from .operations import Triple
from .spectra import X_MATCHING, XYZ_TO_RGB, Y_MATCHING, Z_MATCHING
from .textures.float32 import f32

SMALLEST_SUN = 0.0005  # [rad], of which Cycles takes the sun to be at least
LIMB_DARKENING = 0.6
RINGS, SECTORS = 16, 32  # of half the sun's disc, for its mean

type Spectrum = tuple[float, ...]

# Multiple scattering, at 630, 560, 490 and 430 nm, in kilometers; coefficients at the ground [1/km] where the densities are 1
EARTH_RADIUS, ATMOSPHERE_HEIGHT = 6371.0, 100.0
SUN_IRRADIANCE = (1.679, 1.828, 1.986, 1.307)
MOLECULAR_SCATTERING = (6.605e-3, 1.067e-2, 1.842e-2, 3.156e-2)
MOLECULAR_DECAY, MOLECULAR_EXPONENT = 0.07771971, 1.16364243
_OZONE = 334.5 * 3.78547397e20  # mean column in Dobson units, times a density
OZONE_ABSORPTION = tuple(section * _OZONE for section in (3.472e-25, 3.914e-25, 1.349e-25, 11.03e-27))
OZONE_LOG_HEIGHT, OZONE_SHARPNESS = 3.22261, 5.55555555
_AEROSOLS = 1.3681e20
AEROSOL_SCATTERING = tuple(section * _AEROSOLS for section in (1.5908e-22, 1.7711e-22, 2.0942e-22, 2.4033e-22))
AEROSOL_ABSORPTION = tuple(section * _AEROSOLS for section in (2.8722e-24, 4.6168e-24, 7.9706e-24, 1.3578e-23))
AEROSOL_HEIGHT, AEROSOL_BACKGROUND = 0.73, 2e6 / _AEROSOLS
AEROSOL_ANISOTROPY, GROUND_ALBEDO = 0.8, 0.3
X_OF_SPECTRUM = (53.386917738564668, 43.904844466369358, 1.6137278251608962, 20.762668673810577)
Y_OF_SPECTRUM = (22.981337506691025, 71.347795700053394, 18.422960591455485, 2.3614213523314369)
Z_OF_SPECTRUM = (0.0, 0.10250686796574131, 31.742921188390806, 110.48009643252140)
TRANSMITTANCE_STEPS = SCATTERING_STEPS = 64

# Single scattering, each 20 nm from 380 to 780 nm, in meters
SINGLE_EARTH_RADIUS, SINGLE_ATMOSPHERE_HEIGHT = 6360e3, 60e3
RAYLEIGH_HEIGHT, MIE_HEIGHT = 8e3, 1.2e3
MIE_SCATTERING, MIE_EXTINCTION, MIE_ANISOTROPY = 2e-5, 1.11 * 2e-5, 0.76
SINGLE_STEPS, BANDS = 32, 21
_NANOMETERS = range(380, 381 + 20 * (BANDS - 1), 20)
RAYLEIGH_SCATTERING = 5.424820087636473e-5  # at 380 nm, falling with the fourth power of the wavelength
SINGLE_OZONE_ABSORPTION = (
    *(3.25126849861e-9, 5.85395365047e-9, 1.977191155085e-8, 7.309568762914e-8, 2.0084561514287e-7, 4.0383958096161e-7),
    *(6.3551335912363e-7, 9.670704118097e-7, 1.5479740042441e-6, 2.09038647223331e-6, 2.46128056164565e-6, 2.73551299461512e-6),
    *(2.15125863128643e-6, 1.59051840791988e-6, 1.12356197979857e-6, 7.3527551487574e-7, 4.6450130357806e-7, 3.3096079921048e-7),
    *(2.2512612292678e-7, 1.487912926649e-7, 1.6828623364192e-7),
)
# Optical depths by Gauss's and Laguerre's quadrature of eight nodes, of which 25 is the end of the ray
FIRST_NODES = (0.006811185292, 0.03614807107, 0.09004346519, 0.1706680068)
LAST_NODES = (0.2818362161, 0.4303406404, 0.6296271457, 0.9145252695)
FIRST_WEIGHTS = (0.01750893642, 0.04135477391, 0.06678839063, 0.09507698807)
LAST_WEIGHTS = (0.1283416365, 0.1707430204, 0.2327233347, 0.3562490486)


def _black_body(nanometers: float) -> float:
    """Return the sun's irradiance above the air [W/(m^2 nm)]: that of a black body of 5778 K that gives 1.79095 at 500 nm."""

    def shape(wavelength: float) -> float:
        return 1.0 / (wavelength**5 * math.expm1(1.438776877e7 / (wavelength * 5778.0)))

    return 1.7909510847583856 * shape(nanometers) / shape(500.0)


def _sun_xyz(index: int, nanometers: int) -> Triple:
    """Return the XYZ of the sun's irradiance in the 20 nm around a wavelength."""
    irradiance = 20.0 * _black_body(nanometers)
    x, y, z = (1e-4 * irradiance * matching[4 * index] for matching in (X_MATCHING, Y_MATCHING, Z_MATCHING))
    return x, y, z


SINGLE_SUN_XYZ = tuple(_sun_xyz(index, wavelength) for index, wavelength in enumerate(_NANOMETERS))


@dataclass(frozen=True)
class Atmosphere:
    """What the light of the air depends on.

    The sun's elevation [rad], the viewer's altitude [m], and densities of which 1 is usual.
    """

    is_multiple: bool
    """Whether light that was scattered before is scattered again (multiple scattering)."""
    sun_elevation: float
    altitude: float
    air_density: float
    aerosol_density: float
    ozone_density: float


@dataclass(frozen=True)
class SunDisc:
    """The sun in a sky: its angular diameter [rad], and a factor of its radiance."""

    diameter: float
    intensity: float


@dataclass(frozen=True)
class Sun:
    """The sun as a light: the direction to its center, its angular diameter [rad], and its mean radiance over that disc.

    The radiance is linear Rec. 709, in the unit of the sky's.
    """

    direction: Triple
    diameter: float
    radiance: Triple

    @property
    def irradiance(self) -> Triple:
        """That on a plane that faces the sun: the radiance times the disc's solid angle."""
        return _scaled(self.radiance, math.tau * (1.0 - math.cos(self.diameter / 2.0)))


@dataclass(frozen=True)
class Sky:
    """A sky: its air, the azimuth of the sun [rad], clockwise from +Y seen from above, and the sun if it shows, else None."""

    atmosphere: Atmosphere
    sun_rotation: float
    disc: SunDisc | None = None

    @property
    def sun_direction(self) -> Triple:
        """The unit vector towards the sun's center."""
        elevation, rotation = self.atmosphere.sun_elevation, self.sun_rotation
        flat = math.cos(elevation)
        return flat * math.sin(rotation), flat * math.cos(rotation), math.sin(elevation)

    @property
    def lowest_elevation(self) -> float:
        """Where the ground begins and hides the sun [rad], 0 or less."""
        return math.asin(EARTH_RADIUS / (EARTH_RADIUS + self.atmosphere.altitude / 1000.0)) - math.pi / 2.0

    @cached_property
    def disc_ends(self) -> tuple[Triple, Triple]:
        """The XYZ of the sun's disc at its lowest and at its highest point without limb darkening; ValueError without a disc."""
        if self.disc is None:
            raise ValueError("the sky shows no sun")
        center, radius = self.atmosphere.sun_elevation, self.disc.diameter / 2.0
        # Blender's solid angle is that of a cosine of 32 bits: 0.1 % too large for the usual diameter, and double for the smallest
        scale = self.disc.intensity / (math.tau * (1.0 - f32(math.cos(radius))))
        ends = center - radius, center + radius
        if self.atmosphere.is_multiple:
            low, high = (_multiple_transmitted(self.atmosphere, elevation) for elevation in ends)
        elif ends[1] > 0.0:
            low, high = (_single_transmitted(self.atmosphere, max(elevation, 0.0)) for elevation in ends)
        else:
            low = high = (0.0, 0.0, 0.0)
        return _scaled(low, scale), _scaled(high, scale)

    def sun(self) -> Sun | None:
        """Return the sun as a light; None where the sky shows none, or only below the ground.

        What the ground hides of the disc counts as black in its mean.
        """
        if self.disc is None:
            return None
        total, sums = 0.0, [0.0, 0.0, 0.0]
        for weight, xyz in self._disc_samples(self.disc.diameter / 2.0):
            total += weight
            sums = [a + weight * b for a, b in zip(sums, _rgb(xyz), strict=True)]
        red, green, blue = (value / total for value in sums)
        return Sun(self.sun_direction, self.disc.diameter, (red, green, blue)) if red or green or blue else None

    def _disc_samples(self, radius: float) -> Iterator[tuple[float, Triple]]:
        """Yield the weight and the XYZ of the sun at points of half its disc, whose other half is the mirror."""
        center, lowest = self.atmosphere.sun_elevation, self.lowest_elevation
        low, high = self.disc_ends
        for ring in range(RINGS):
            depth = (ring + 0.5) / RINGS  # cosine on the sun's sphere, by which the limb darkens
            angle = radius * math.sqrt(1.0 - depth * depth)
            weight, limb = depth * math.sin(angle) / angle, 1.0 - LIMB_DARKENING * (1.0 - depth)
            for sector in range(SECTORS):
                azimuth = math.pi * (sector + 0.5) / SECTORS
                height = math.sin(center) * math.cos(angle) + math.cos(center) * math.sin(angle) * math.cos(azimuth)
                elevation = math.asin(min(max(height, -1.0), 1.0))
                along = 0.5 + (elevation - center) / (2.0 * radius)
                brightness = limb if elevation > lowest else 0.0
                x, y, z = ((a + (b - a) * along) * brightness for a, b in zip(low, high, strict=True))
                yield weight, (x, y, z)


def placed_sun(elevation: float, rotation: float) -> tuple[float, float]:
    """Return elevation and rotation of the same direction [rad], the first in [-pi / 2, pi / 2], the second in [0, 2 pi)."""
    elevation = math.remainder(elevation, math.tau)
    if abs(elevation) > math.pi / 2.0:
        elevation, rotation = math.copysign(math.pi, elevation) - elevation, rotation + math.pi
    return elevation, rotation % math.tau


def _scaled(xyz: Triple, factor: float) -> Triple:
    return xyz[0] * factor, xyz[1] * factor, xyz[2] * factor


def _rgb(xyz: Triple) -> Triple:
    """Return linear Rec. 709, as far as it is positive."""
    red, green, blue = (max(dot(row, xyz), 0.0) for row in XYZ_TO_RGB)
    return red, green, blue


def _extinction(air: Atmosphere, height: float) -> Spectrum:
    """Return what a kilometer of air absorbs and scatters [1/km] at a height [km], at the wavelengths of multiple scattering."""
    logarithm = math.log(max(height, 1e-4))
    molecular = air.air_density * math.exp(-MOLECULAR_DECAY * height**MOLECULAR_EXPONENT)
    ozone = air.ozone_density * math.exp(-OZONE_SHARPNESS * (logarithm - OZONE_LOG_HEIGHT) ** 2 - logarithm)
    aerosol = air.aerosol_density * (math.exp(-height / AEROSOL_HEIGHT) + AEROSOL_BACKGROUND)
    coefficients = zip(MOLECULAR_SCATTERING, OZONE_ABSORPTION, AEROSOL_SCATTERING, AEROSOL_ABSORPTION, strict=True)
    return tuple(molecular * a + ozone * b + aerosol * (c + d) for a, b, c, d in coefficients)


def _multiple_transmitted(air: Atmosphere, elevation: float) -> Triple:
    """Return the XYZ of the sun's light that arrives from a direction [rad], of the irradiance above the air."""
    altitude = min(max(air.altitude, 1.0), 99999.0) / 1000.0
    radius, cosine = EARTH_RADIUS + altitude, math.sin(elevation)
    along = radius * cosine
    top = EARTH_RADIUS + ATMOSPHERE_HEIGHT
    step = (math.sqrt(along * along + (top - radius) * (top + radius)) - along) / TRANSMITTANCE_STEPS
    depth = [0.0] * len(SUN_IRRADIANCE)
    for index in range(TRANSMITTANCE_STEPS):
        t = (index + 0.5) * step
        height = max(math.sqrt(radius * radius + t * (t + 2.0 * along)) - EARTH_RADIUS, 0.0)
        depth = [a + b * step for a, b in zip(depth, _extinction(air, height), strict=True)]
    arriving = [irradiance * math.exp(-d) for irradiance, d in zip(SUN_IRRADIANCE, depth, strict=True)]
    x, y, z = (math.sumprod(arriving, matching) for matching in (X_OF_SPECTRUM, Y_OF_SPECTRUM, Z_OF_SPECTRUM))
    return x, y, z


def _single_transmitted(air: Atmosphere, elevation: float) -> Triple:
    """Return what `_multiple_transmitted` does where light is scattered once. Blender leaves out the ozone here."""
    radius = SINGLE_EARTH_RADIUS + min(max(air.altitude, 1.0), 59999.0)
    top = SINGLE_EARTH_RADIUS + SINGLE_ATMOSPHERE_HEIGHT
    along = radius * math.sin(elevation)
    length = math.sqrt(along * along + (top - radius) * (top + radius)) - along
    rayleigh = mie = 0.0
    for node, weight in zip(FIRST_NODES + LAST_NODES, FIRST_WEIGHTS + LAST_WEIGHTS, strict=True):
        t = node * length
        height = math.sqrt(radius * radius + t * (t + 2.0 * along)) - SINGLE_EARTH_RADIUS
        rayleigh += weight * length * math.exp(-height / RAYLEIGH_HEIGHT) * air.air_density
        mie += weight * length * math.exp(-height / MIE_HEIGHT) * air.aerosol_density
    scattering = (RAYLEIGH_SCATTERING * (380.0 / wavelength) ** 4 for wavelength in _NANOMETERS)
    transmitted = [math.exp(-rayleigh * molecular - mie * MIE_EXTINCTION) for molecular in scattering]
    x, y, z = (math.sumprod(transmitted, column) for column in zip(*SINGLE_SUN_XYZ, strict=True))
    return x, y, z
