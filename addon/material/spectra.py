# SPDX-License-Identifier: GPL-3.0-or-later
"""The colors of Blender's Blackbody and Wavelength nodes, linear Rec. 709. No bpy.

The fits of the blackbody and the color matching functions are those of Cycles 5.2 (intern/cycles/kernel/tables.h).
"""

import math

from ..models.vector import dot
from .operations import Triple

# From a temperature [K] on: a, b, c of a / T + b T + c for red and green, and of ((a T + b) T + c) T + d for blue
FITS = (
    (
        800.0,
        (1.61919106e03, -2.05010916e-03, 5.02995757),
        (-4.88999748e02, 6.04330754e-04, -7.55807526e-02),
        (5.96945309e-11, -4.85742887e-08, -9.70622247e-05, -4.07936148e-03),
    ),
    (
        965.0,
        (2.48845471e03, -1.11330907e-03, 3.22621544),
        (-7.55994277e02, 3.16730098e-04, 4.78306139e-01),
        (2.40430366e-11, 5.55021075e-08, -1.98503712e-04, 2.89312858e-02),
    ),
    (
        1167.0,
        (3.34143193e03, -4.86551192e-04, 1.76486769),
        (-1.02363977e03, 1.20223470e-04, 9.36662319e-01),
        (-1.40949732e-11, 1.89878968e-07, -3.56632824e-04, 9.10767778e-02),
    ),
    (
        1449.0,
        (4.09461742e03, -1.27446582e-04, 7.25731635e-01),
        (-1.26571316e03, 4.87340896e-06, 1.27054498),
        (-3.61460868e-11, 2.84822009e-07, -4.93211319e-04, 1.56723440e-01),
    ),
    (
        1902.0,
        (4.67028036e03, 2.91258199e-05, 1.26703442e-01),
        (-1.42529332e03, -4.01150431e-05, 1.43972784),
        (-1.97075738e-11, 1.75359352e-07, -2.50542825e-04, -2.22783266e-02),
    ),
    (
        3315.0,
        (4.59509185e03, 2.87495649e-05, 1.50345020e-01),
        (-1.17554822e03, -2.16378048e-05, 1.30408023),
        (-1.61997957e-13, -1.64216008e-08, 3.86216271e-04, -7.38077418e-01),
    ),
    (
        6365.0,
        (3.78717450e03, 9.35907826e-06, 3.99075871e-01),
        (-5.00799571e02, -4.59832026e-06, 1.09098763),
        (6.72650283e-13, -2.73078809e-08, 4.24098264e-04, -7.52335691e-01),
    ),
)
COLDEST = (5.413294490189271, 0.0, 0.0)  # below 800 K
HOTTEST = (0.8262954810464208, 0.9945080501520986, 1.566307710274283)  # from 12000 K on

# CIE 1931 color matching functions, in ten thousandths, each 5 nm from 380 nm on
FIRST_NM, STEP_NM = 380.0, 5.0


def _matching(text: str) -> tuple[int, ...]:
    return tuple(int(value) for value in text.split())


X_MATCHING = _matching(
    """
    14 22 42 76 143 232 435 776 1344 2148 2839 3285 3483 3481 3362 3187 2908 2511 1954 1421 956 580 320 147 49 24 93 291 633
    1096 1655 2257 2904 3597 4334 5121 5945 6784 7621 8425 9163 9786 10263 10567 10622 10456 10026 9384 8544 7514 6424 5419
    4479 3608 2835 2187 1649 1212 874 636 468 329 227 158 114 81 58 41 29 20 14 10 7 5 3 2 2 1 1 1 0
    """
)
Y_MATCHING = _matching(
    """
    0 1 1 2 4 6 12 22 40 73 116 168 230 298 380 480 600 739 910 1126 1390 1693 2080 2586 3230 4073 5030 6082 7100 7932 8620
    9149 9540 9803 9950 10000 9950 9786 9520 9154 8700 8163 7570 6949 6310 5668 5030 4412 3810 3210 2650 2170 1750 1382 1070
    816 610 446 320 232 170 119 82 57 41 29 21 15 10 7 5 4 2 2 1 1 1 1 0 0 0 0
    """
)
Z_MATCHING = _matching(
    """
    65 105 201 362 679 1102 2074 3713 6456 10391 13856 16230 17471 17826 17721 17441 16692 15281 12876 10419 8130 6162 4652
    3533 2720 2123 1582 1117 782 573 422 298 203 134 87 57 39 27 21 18 17 14 11 10 8 6 3 2 2 1 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0
    0 0 0 0 0 0 0 0 0 0 0 0 0 0 0
    """
)
XYZ_TO_RGB = (  # of ITU-R BT.709 with the white point D65
    (3.24096994, -1.53738318, -0.49861076),
    (-0.96924364, 1.8759675, 0.04155506),
    (0.05563008, -0.20397696, 1.05697151),
)
WAVELENGTH_SCALE = 1.0 / 2.52  # about the largest component of what follows without it


def blackbody(kelvin: float) -> Triple:
    """Return the color of a black body of that temperature, of luminance about 1."""
    if kelvin < FITS[0][0]:
        return COLDEST
    if kelvin >= 12000.0:
        return HOTTEST
    _, red, green, blue = next(fit for fit in reversed(FITS) if kelvin >= fit[0])
    r, g = (a / kelvin + b * kelvin + c for a, b, c in (red, green))
    a, b, c, d = blue
    return max(r, 0.0), max(g, 0.0), max(((a * kelvin + b) * kelvin + c) * kelvin + d, 0.0)


def wavelength(nanometers: float) -> Triple:
    """Return the color of light of that wavelength, as far as it is within Rec. 709; black where it is not visible."""
    steps = (nanometers - FIRST_NM) / STEP_NM
    index = math.trunc(steps)
    if index < 0 or index >= len(X_MATCHING) - 1:
        return 0.0, 0.0, 0.0
    x, y, z = (
        matching[index] + (matching[index + 1] - matching[index]) * (steps - index)
        for matching in (X_MATCHING, Y_MATCHING, Z_MATCHING)
    )
    red, green, blue = (max(dot(row, (x, y, z)) * 1e-4 * WAVELENGTH_SCALE, 0.0) for row in XYZ_TO_RGB)
    return red, green, blue
