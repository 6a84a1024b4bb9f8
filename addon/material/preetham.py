# SPDX-License-Identifier: GPL-3.0-or-later
"""The sky type Preetham of Blender's Sky Texture, made of operations. No bpy.

A. J. Preetham, P. Shirley, B. Smits, "A Practical Analytic Model for Daylight" (1999), appendix A.2, as Cycles 5.2 has it
(scene/shader_nodes.cpp and kernel/svm/sky.h).
"""

import math

from .expression import Expression, apply
from .operations import Triple
from .spectra import XYZ_TO_RGB

LOWEST = math.sin(0.001)  # cosine to the zenith, below which the sky is as there
LUMINANCE_SCALE = 0.06  # Cycles' factor of the zenith's luminance [kcd/m^2]
# Coefficients A to E of Perez's function of the luminance Y and of the chromaticities x and y: factor of the turbidity, constant
COEFFICIENTS = (
    ((0.1787, -1.4630), (-0.3554, 0.4275), (-0.0227, 5.3251), (0.1206, -2.5771), (-0.0670, 0.3703)),
    ((-0.0193, -0.2592), (-0.0665, 0.0008), (-0.0004, 0.2125), (-0.0641, -0.8989), (-0.0033, 0.0452)),
    ((-0.0167, -0.2608), (-0.0950, 0.0092), (-0.0079, 0.2102), (-0.0441, -1.6537), (-0.0109, 0.0529)),
)
# Of the zenith's x and y: rows for the square of the turbidity, itself and 1, columns for powers 3 to 0 of the sun's angle
ZENITH_X = ((0.00166, -0.00375, 0.00209, 0.0), (-0.02903, 0.06377, -0.03202, 0.00394), (0.11693, -0.21196, 0.06052, 0.25886))
ZENITH_Y = ((0.00275, -0.00610, 0.00317, 0.0), (-0.04214, 0.08970, -0.04153, 0.00516), (0.15346, -0.26756, 0.06670, 0.26688))


def preetham(direction: Expression, sun: Triple, turbidity: float, label: str = "") -> Expression:
    """Return the color of the sky towards `direction`, which Blender takes at any length; `sun` is the unit vector to the sun."""
    cosine = min(max(sun[2], -1.0), 1.0)
    angle = math.acos(cosine)

    def op(operation: str, *arguments: Expression | float | Triple) -> Expression:
        return apply(operation, *arguments, label=label)

    z = op("clamp", op("z", direction), -1.0, 1.0)
    # the azimuth counts by itself, as z may be that of a longer or shorter vector
    flat = op("sqrt", op("subtract", 1.0, op("multiply", z, z)))
    around = op("dot", op("normalize", op("multiply", direction, (1.0, 1.0, 0.0))), _flat(sun))
    from_sun = op("add", op("multiply", op("multiply", flat, around), math.sin(angle)), op("multiply", z, cosine))
    gamma, to_zenith = op("arccosine", from_sun), op("maximum", z, LOWEST)
    cosine_squared = op("power", op("clamp", from_sun, -1.0, 1.0), 2.0)

    def perez(pairs: tuple[tuple[float, float], ...], zenith: float) -> Expression:
        a, b, c, d, e = (factor * turbidity + constant for factor, constant in pairs)
        # at the zenith, where its angle is 0 and gamma is the sun's
        whole = (1.0 + a * math.exp(b)) * (1.0 + c * math.exp(d * angle) + e * cosine * cosine)
        height = op("add", op("multiply", op("exponent", op("divide", b, to_zenith)), a), 1.0)
        glow = op("add", op("multiply", op("exponent", op("multiply", gamma, d)), c), op("multiply", cosine_squared, e))
        return op("multiply", op("multiply", height, op("add", glow, 1.0)), zenith / whole)

    luminance, x, y = map(perez, COEFFICIENTS, (_zenith_luminance(angle, turbidity), *_zenith_xy(angle, turbidity)))
    per_y = op("divide", luminance, y)
    xyz = op("combine", op("multiply", x, per_y), luminance, op("multiply", op("subtract", op("subtract", 1.0, x), y), per_y))
    return op("maximum", op("combine", *(op("dot", xyz, row) for row in XYZ_TO_RGB)), (0.0, 0.0, 0.0))


def _flat(sun: Triple) -> Triple:
    """Return the sun's azimuth as a vector, +Y where it is straight above."""
    length = math.hypot(sun[0], sun[1])
    return (sun[0] / length, sun[1] / length, 0.0) if length else (0.0, 1.0, 0.0)


def _zenith_luminance(angle: float, turbidity: float) -> float:
    chi = (4.0 / 9.0 - turbidity / 120.0) * (math.pi - 2.0 * angle)
    return LUMINANCE_SCALE * ((4.0453 * turbidity - 4.9710) * math.tan(chi) - 0.2155 * turbidity + 2.4192)


def _zenith_xy(angle: float, turbidity: float) -> tuple[float, float]:
    powers = (angle**3, angle**2, angle, 1.0)
    turbidities = (turbidity**2, turbidity, 1.0)
    x, y = (math.sumprod(turbidities, [math.sumprod(row, powers) for row in rows]) for rows in (ZENITH_X, ZENITH_Y))
    return x, y
