# SPDX-License-Identifier: GPL-3.0-or-later
"""Inputs of the engines' Subsurface closures with which one medium looks alike in all of them.

The medium is a half-space of isotropic scattering with mean free path l = 1 / sigma_t' and an index-matched boundary. Seen along
the normal (light's way turned round: a beam from mu = MU) it reflects the fraction `color`, and the edge of a shadow on it is
`edge_width(color)` l wide. The engines take other numbers for that:

- Cycles, Random Walk: enters along the refracted view direction and walks, then scatters as Lambert where it comes out. At the
  closure's largest IOR and Roughness 0 it enters nearly along the normal, from wherever it is seen. It turns the color into alpha
  by van de Hulst's fit, which holds for light from everywhere; so the color here is that of the alpha which the beam needs. Below
  LEAST_ALPHA it scales what that reflects. It ends after 256 steps: what would have come later (`lost`) is a Lambert
  closure's, and the mean free path longer, for the width to be right again.
- Cycles, Random Walk (Legacy): the same, by another fit of the color (M. Wrenninge, R. Villemin, C. Hery, "Path Traced Subsurface
  Scattering using Anisotropic Phase Functions and Non-Exponential Free Flights", 2017) and with a radius of 4 pi mean free paths.
- Cycles, Random Walk (Skin): half of the light enters as from everywhere, and the radius shrinks by sqrt(3 (1 - alpha')) of a
  standard dipole. Its color moves with the view, by up to a fifth; right is what is seen along the normal.
- Cycles, Christensen-Burley: the profile of burley.py with d = radius / (4 pi), normalized to the color.
- EEVEE: the same profile on the screen with d = radius / (4 pi s(A)), A = color / its brightest channel, eq. (6) of the paper. It
  cuts the profile short (SCREEN), and keeps radii in 10 bits, on average half a step too small (HALF_STEP). Light through thin
  matter it multiplies by color and `eevee_profile(depth / radius)`. A slab lets more through than that with the radius of what it
  reflects, so where light comes from behind the closure takes another (`through_radius`).

`scripts/fit/subsurface.py` finds the numbers. All arguments are clamped to [0, 1], NaN to 0.
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

from ..models.burley import EDGE_WIDTH_25_75
from ..models.geometry import clamp
from ..models.half_space import VAN_DE_HULST, Rational
from ..models.terms import FLOATS, Arithmetic, Number, polynomial

IOR, SKIN_IOR = 3.8, 1.4  # of the closure, to bend what enters; not of the surface
MU = 0.988  # mean cosine inside at IOR, over all views
LAMBERT_BELOW = 1e-6  # mean free path in Blender's units: 32-bit floats resolve no less; shorter ones are Lambert's
LEAST_ALPHA, STEPS = 0.2, 255.5
H = 2.8866  # Chandrasekhar's H(MU) at alpha = 1
# Exact slopes at both ends: -H in s at 0, and (1 - MU ln(1 + 1 / MU)) / 2 in alpha at 0. To 5e-5.
BEAM = Rational(-0.445, H - 0.555, 1.445 / 0.309189 - H - 0.445)
DARKEST = BEAM.reflectance(math.sqrt(1.0 - LEAST_ALPHA))
DARKENING = 0.5 * 0.309189 * LEAST_ALPHA / DARKEST  # of what Cycles scales, at color 0
WIDTH = (0.28634, 1.0129, -0.48255, -0.66528)  # three above, one below; to 1.8 %, most of it the noise of the walks
LEGACY = (1.3107, -0.60442, 0.86078, -1.6972, 2.1084, -1.0567)
SKIN = (1.1167, -0.2224, 0.54516, -1.6331, 2.3059, -1.1888)
SKIN_SHRINKING = (1.9349, -3.7188, 1.8027, 5.4531, -5.6936)  # three above, two below
SKIN_LOST = 0.75  # of what Random Walk loses: as much as keeps white at 1
SCREEN = 1.05  # as measured on edges of 10 cm
HALF_STEP = 1.0 / 1023.0  # Blender's units, of radii up to 1
LONGER = (1.0, 4.0, 12.0)  # in the fraction of the color that is lost
EEVEE_DECAY = 3.6  # of `eevee_profile`, nearly
THROUGH = (9.6308, -10.159, 34.206, 21.11, -20.758)  # polynomial in the color; to 5 %


class ClosureInputs(NamedTuple):
    """Inputs of a Subsurface closure and of a Lambert closure added to it: one channel, or all as sockets."""

    color: Number
    radius: Number
    """In mean free paths of the medium."""
    rest: Number
    """Color of the Lambert closure."""


def rational(coefficients: Sequence[float], above: int, x: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return (n_0 + n_1 x + ...) / (1 + d_1 x + ...), given the `above` numbers of the numerator and those of the denominator."""
    numerator = polynomial(ops, coefficients[:above], x)
    return numerator / polynomial(ops, (1.0, *coefficients[above:]), x) if coefficients[above:] else numerator


def edge_width(color: float) -> float:
    """Return how wide the edge of a shadow is on the medium that reflects `color`, from 25 to 75 % [mean free paths]."""
    return rational(WIDTH, 3, clamp(color, 0.0, 1.0))


def darkened(color: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return `color` in [0, 1], less where Cycles scales what it reflects at LEAST_ALPHA, which is more than a medium reflects."""
    return color * ops.minimum(color * ((1.0 - DARKENING) / DARKEST) + DARKENING, 1.0)


def lost(s: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the fraction of light that a walk would bring back after its last step, for alpha = 1 - s^2.

    H / sqrt(pi n) [e^(-t^2) - sqrt(pi) t erfc(t)], t = s sqrt(n): the tail of the orders n^(-3/2) that H s begins. The bracket is
    e^(-t^2) / (1 + sqrt(pi) t + 1.3 t^2) to 0.003.
    """
    t = s * math.sqrt(STEPS)
    tail = ops.power(1.0 / math.e, t * t) / polynomial(ops, (1.0, math.sqrt(math.pi), 1.3), t)
    return tail * (H / math.sqrt(math.pi * STEPS))


def random_walks(color: Number, ops: Arithmetic = FLOATS) -> dict[str, ClosureInputs]:
    """Return the inputs of Cycles' random walks for a medium that reflects `color` in [0, 1], by Blender's name of the method.

    At IOR and Roughness 0, or RANDOM_WALK_SKIN at SKIN_IOR. Longer mean free paths compensate what is lost, so that an edge
    keeps its width.
    """
    dark = darkened(color, ops)
    s = BEAM.s(dark, ops)
    rest = lost(s, ops)
    longer = polynomial(ops, LONGER, rest / ops.maximum(color, DARKEST))
    shrinking = rational(SKIN_SHRINKING, 3, color, ops)
    return {
        "RANDOM_WALK": ClosureInputs(VAN_DE_HULST.reflectance(s, ops), longer, rest),
        "RANDOM_WALK_SKIN": ClosureInputs(dark * polynomial(ops, SKIN, dark), longer / shrinking, rest * SKIN_LOST),
        "RANDOM_WALK_LEGACY": ClosureInputs(dark * polynomial(ops, LEGACY, dark), longer * (4.0 * math.pi), rest),
    }


def eevee_profile(x: float) -> float:
    """Return the fraction of light from behind that EEVEE 5.2 lets through a depth of `x` radii, 0 or more; its own formula."""
    if x >= 2.0:
        return 0.0
    narrow, wide = math.exp(-((3.4 * x) ** 1.6)), math.exp(-EEVEE_DECAY * x**1.11)
    share = min(1.0, 0.5 + x / 0.6) ** 2
    return (narrow + (wide - narrow) * share) * (1.0 - (0.5 * x) ** 5)


def through_radius(color: Number, ops: Arithmetic = FLOATS) -> Number:
    """Return the radius [mean free paths] with which EEVEE lets light through as a slab does of the medium that reflects `color`.

    EEVEE measures the depth along the light, on average 3/2 of the slab's over light from everywhere. Light that is scattered
    often takes the shortest way; the less of it is, the nearer to the light's own way: with k, `half_space.diffusion_root`, EEVEE's
    depth counts as 1.5 - 0.3 k of the slab's, by the ears of the face scene in light and dark skin.
    """
    return polynomial(ops, THROUGH, color)


def closure_inputs(method: str, color: float) -> ClosureInputs:
    """Return the closures' inputs in Cycles for a medium that reflects `color`, clamped to [0, 1]; `method` is Blender's name."""
    color = clamp(color, 0.0, 1.0)
    if method == "BURLEY":
        return ClosureInputs(color, 4.0 * math.pi * edge_width(color) / EDGE_WIDTH_25_75, 0.0)
    return random_walks(color)[method]
