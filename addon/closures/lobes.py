# SPDX-License-Identifier: GPL-3.0-or-later
"""The rough models made of the closures that the engines offer: what the node group renders, since no node sees the light.

With rho the albedo, x, y, z the components of L along V_t (the unit tangent towards the viewer), N x V_t and N, and mu = N.V, every
model is a share of Lambert's z and of one function of the light that knows no roughness (`expansion`):

    L_r = (rho / pi) E0 [ w_z z + w F(L, mu) ]

For equation (1) that is A z + B T, T = max(0, s) min(1, z / mu). Four schemes make the functions of closures, each a sum of lobes
c(mu) max(0, d.L) around directions d that move with mu; `lobe_table.py` has the numbers, `scripts/fit/lobes.py` finds them.

- SINGLE, EEVEE: one Diffuse closure around the vector sum of all lobes.
- PAIR, EEVEE: one around N, one bent towards the viewer. H = clamp(10 z + 1) is EEVEE's own: light from behind the surface fades
  out within 6 degrees.
- SIGNED, EEVEE: lobes of either sign, each through its own Shader to RGB, beside a base around N. They are fitted so that a
  uniform world, which EEVEE does not cut off at a lobe's horizon, is reflected as it should be, too.
- CYCLES: its Diffuse closure is Fujii's model, exact for the viewer's side of N; one lobe 85.6 degrees away from the viewer mends
  the other side. G is Cycles' own ("bump map correction"): the shadowing of a GGX surface of alpha^2 = tan^2(angle of N, M) / 8, at
  most 1, by A. Conty Estevez, P. Lecocq, C. Stein, "A Microfacet-Based Shadowing Function to Solve the Bump Terminator Problem"
  (2019).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from ..models.cycles_diffuse import CyclesDiffuse
from ..models.eon import Eon, fujii_average_albedo, fujii_directional_albedo
from ..models.fujii import K1, Fujii
from ..models.geometry import clamp
from ..models.oren_nayar import OrenNayar
from ..models.oren_nayar_1994 import OrenNayar1994
from ..models.pits import Pits
from ..models.protocol import Model
from ..models.vector import Vector, add, dot, normalize, scale
from ..models.wolff import Wolff
from .lobe import CYCLES, PAIR, SIGNED, SINGLE, Fit, eevee_horizon, lobe_values
from .lobe_table import TABLE, TRANSMITTANCE


class Expansion(NamedTuple):
    """A model in units of (rho / pi) E0: `facing` times z, and functions of the light by name, with their weights."""

    facing: float
    functions: Mapping[str, float]


def expansion(model: Model, mu: float, rho: float) -> Expansion:
    """Return `model` as z and functions of the light, seen at N.V = `mu`, for the albedo `rho`.

    Exact but for two factors of the light alone that become their mean over all lights, which keeps the energy: 1 - E(N.L) of the
    multiple scattering, and Wolff's transmittance of the light that enters.
    """
    match model:
        case OrenNayar1994():
            twice = rho * model.interreflection
            return Expansion(model.a + twice, {"oren_nayar_1994": model.b, "interreflection": -twice})
        case OrenNayar():
            return Expansion(model.a, {"oren_nayar": model.b})
        case Fujii():
            a = 1.0 / (1.0 + K1 * model.roughness)
            return Expansion(a, {"fujii": a * model.roughness})
        case Eon() | CyclesDiffuse():
            single = expansion(Fujii(model.roughness), mu, rho)
            return Expansion(single.facing + _multiple(model, mu, rho), single.functions)
        case Wolff():
            return Expansion(model.boundary.transmittance(mu) * average_transmittance(model.ior), {})
        case Pits():
            return Expansion(rho / (4.0 - 2.0 * rho), {"pits": 1.0})
        case _:
            return Expansion(1.0, {})


def _multiple(model: Eon | CyclesDiffuse, mu: float, rho: float) -> float:
    """Return what is reflected more than once towards N.V = `mu`, over rho: the same for all lights."""
    average = fujii_average_albedo(model.roughness)
    again = rho * average / (1.0 - rho * (1.0 - average))
    if isinstance(model, CyclesDiffuse):
        again *= rho
    return again * (1.0 - fujii_directional_albedo(model.roughness, mu))


def average_transmittance(ior: float) -> float:
    """Return the mean of 1 - F over all light that falls on a smooth dielectric, evenly from everywhere; `ior` n in [1, 3]."""
    f = (ior - 1.0) / (ior + 1.0)
    c_1, c_2, c_3 = TRANSMITTANCE
    return 1.0 - f * (c_1 + f * (c_2 + f * c_3))


@dataclass(frozen=True)
class Rendered:
    """What the node group reflects for `model` by a `scheme`; the package's `Model` interface."""

    model: Model
    scheme: str
    table: Mapping[str, Mapping[str, Fit]] = field(default_factory=lambda: TABLE, repr=False)

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; in EEVEE also from just below the horizon."""
        n, l, v = normalize(n), normalize(l), normalize(v)
        mu, z, rho = min(1.0, dot(n, v)), dot(n, l), clamp(albedo, 0.0, 1.0)
        if mu <= 0.0 or (self.scheme == CYCLES and z <= 0.0):
            return 0.0
        if self.scheme == CYCLES and isinstance(self.model, Eon | CyclesDiffuse | Fujii):
            return self.model.radiance(n, l, v, albedo)  # Cycles has them
        tangent = normalize(add(v, scale(n, -mu)))
        x = dot(tangent, l)
        y = math.sqrt(max(0.0, 1.0 - x * x - z * z))
        facing, functions = expansion(self.model, mu, rho)
        family = next(iter(functions), None)
        if family is None:
            return rho / math.pi * facing * max(0.0, z)
        lobes, table = self.table[self.scheme][family]
        weights = [sum(w * table[name][k].at(mu) for name, w in functions.items()) for k in range(len(next(iter(table.values()))))]
        values = lobe_values(self.scheme, lobes, x, y, z, mu)
        total = sum(weight * value for weight, value in zip(weights, values, strict=True))
        if self.scheme == SINGLE:
            return rho / math.pi * max(0.0, facing * z + total) if z > 0.0 else 0.0
        if self.scheme == SIGNED:
            below = facing - floor(functions, mu)  # the base around N, apart from what keeps the sum of lobes positive
            return rho / math.pi * (below * max(0.0, z) + eevee_horizon(z) * max(0.0, total + (facing - below) * max(0.0, z)))
        if self.scheme == PAIR:
            around, bent = max(0.0, facing + weights[0]), max(0.0, weights[1])  # closures have no negative colors
            return rho / math.pi * eevee_horizon(z) * (around * values[0] + bent * values[1])
        base, fujii = facing + weights[0], weights[1]
        rest = total - weights[0] * z - fujii * values[1]
        return rho / math.pi * (base * z + min(fujii, base) * values[1] + rest)  # a roughness of at most 1


def floor(functions: Mapping[str, float], mu: float) -> float:
    """Return the share of the base around N that the signed lobes carry with them, so that their sum is nowhere negative.

    Fujii's function falls to -z sin(v) and the 1994 model's no lower; those of equation (1) and of pits are positive.
    """
    sine = math.sqrt(1.0 - mu * mu)
    return sine * sum(abs(weight) for name, weight in functions.items() if name not in ("oren_nayar", "pits"))
