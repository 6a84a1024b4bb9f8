# SPDX-License-Identifier: GPL-3.0-or-later
"""The rough models made of the closures that the engines offer: what the node group renders, since no node sees the light.

`models/terms.py` makes every model a weighted sum of z and of functions of the light that know no roughness: equation (1) is
A z + B T, T = max(0, s) min(1, z / mu). Four sets of lobes make the functions of closures, each a sum of lobes
c(mu) max(0, d.L) around directions d that move with mu; `lobe_table.json` has the numbers, `scripts/fit/lobes.py` finds them.

- SINGLE, EEVEE: one Diffuse closure around the vector sum of all lobes.
- PAIR, EEVEE: one around N, one bent towards the viewer. H = clamp(10 z + 1) is EEVEE's own: light from behind the surface fades
  out within 6 degrees.
- SIGNED, EEVEE: beside a base around N, which is a closure of its own, sums of what Shader to RGB says of single lobes, and
  maxima of them: max(0, x) without its part beyond a crease x = K z / mu, which is within 1 % of T / sin(v) if the crease is split
  sideways. A sum of clamped cosines alone cannot be right under a large light that is partly behind the surface, nor in a uniform
  world: f(L) - f(-L) is linear in L, so where it is 0 below the surface it is Lambert's law. `lobe.capped` says how the maxima
  make it so. Functions that are negative away from the viewer lose the same there, around a crease of their own.
- CYCLES: its Diffuse closure is Fujii's model, exact for the viewer's side of N; one lobe 85.6 degrees away from the viewer
  corrects the other side. Cycles shadows what is bent away from the mesh's normal M ("bump map correction"): as a GGX surface of
  alpha^2 = tan^2(angle between the two) / 8, at most 1, by A. Conty Estevez, P. Lecocq, C. Stein, "A Microfacet-Based Shadowing
  Function to Solve the Bump Terminator Problem" (2019). So it does to Lambert's law where N is not M, and more to the away lobe,
  which then gives way to closures around N. No sum of Diffuse closures of any number and direction would be within 1 % there:
  scripts/fit/mapped.py.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ..models.geometry import clamp
from ..models.protocol import Model
from ..models.quadrature import NORMAL
from ..models.registry import CyclesClosures, by_formula
from ..models.terms import float_view
from ..models.vector import Vector, add, cross, dot, normalize, scale
from .lobe import (
    CYCLES,
    MAPPED_BASE,
    MAPPED_FUJII,
    PAIR,
    SIGNED,
    SINGLE,
    Fit,
    Lobe,
    capped,
    cycles_lobe,
    eevee_horizon,
    lobe_values,
    mapped_share,
)
from .lobe_table import TABLE


@dataclass(frozen=True)
class Rendered:
    """What the node group reflects for `model` by a `lobe_set`; the package's `Model` interface."""

    model: Model
    lobe_set: str
    table: Mapping[str, Mapping[str, Fit]] = field(default_factory=lambda: TABLE, repr=False)
    mesh_normal: Vector | None = None
    """The mesh's normal where N is mapped: in CYCLES, which shadows by it."""

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; in EEVEE also from just below the horizon."""
        n, l, v = normalize(n), normalize(l), normalize(v)
        mu, z, rho = min(1.0, dot(n, v)), dot(n, l), clamp(albedo, 0.0, 1.0)
        if mu <= 0.0 or (self.lobe_set == CYCLES and z <= 0.0):
            return 0.0
        registered = by_formula(self.model)
        tangent = normalize(add(v, scale(n, -mu)))
        across = cross(n, tangent)

        def in_frame(a: Vector) -> Vector:
            return dot(tangent, a), dot(across, a), dot(n, a)

        light = in_frame(l)
        mesh = in_frame(normalize(self.mesh_normal)) if self.mesh_normal and self.lobe_set == CYCLES else NORMAL
        shadow = cycles_lobe(NORMAL, light, mesh) / z if self.lobe_set == CYCLES else 1.0
        if self.lobe_set == CYCLES and registered.cycles is not CyclesClosures.LOBES:
            return self.model.radiance(n, l, v, albedo) * shadow  # Cycles has it
        facing, functions = registered.terms_of(self.model, float_view(mu, rho)).expansion()
        family = next(iter(functions), None)
        if family is None:
            return rho / math.pi * facing * max(0.0, z) * shadow
        lobes, table = self.table[self.lobe_set][family]
        weights = [sum(w * table[name][k].at(mu) for name, w in functions.items()) for k in range(len(next(iter(table.values()))))]
        if self.lobe_set == SIGNED:
            base, reserve = shares(facing + weights[0], lobes, weights)
            toward, *away = (capped(lobe, light, mu, *weights[2 * k + 1 : 2 * k + 3]) for k, lobe in enumerate(lobes))
            lit = max(0.0, z)
            return rho / math.pi * (base * lit + max(0.0, reserve * lit + toward - sum(away)))
        values = lobe_values(self.lobe_set, lobes, light, mu, mesh)
        total = sum(weight * value for weight, value in zip(weights, values, strict=True))
        if self.lobe_set == SINGLE:
            return rho / math.pi * max(0.0, facing * z + total) if z > 0.0 else 0.0
        if self.lobe_set == PAIR:
            around, bent = max(0.0, facing + weights[0]), max(0.0, weights[1])  # closures have no negative colors
            return rho / math.pi * eevee_horizon(z) * (around * values[0] + bent * values[1])
        base, fujii, away = facing + weights[0], weights[1], weights[2]
        if away:
            rest = 1.0 - mapped_share(mesh[2])
            base, fujii, away = base + rest * MAPPED_BASE * away, fujii * (1.0 - rest * MAPPED_FUJII * mu), away * (1.0 - rest)
        return rho / math.pi * (base * values[0] + min(fujii, base) * values[1] + away * values[2])  # a roughness of at most 1


@dataclass(frozen=True)
class Shadowed:
    """A `model` times the factor by which Cycles shadows Lambert's law around an N that is not the mesh's, `mesh_normal`."""

    model: Model
    mesh_normal: Vector

    def radiance(self, n: Vector, l: Vector, v: Vector, albedo: float) -> float:
        """Return the reflected radiance [W/(m^2 sr)] for E0 = 1 W/m^2; unit vectors."""
        n_dot_l = dot(n, l)
        if n_dot_l <= 0.0:
            return 0.0
        return self.model.radiance(n, l, v, albedo) * (cycles_lobe(n, l, self.mesh_normal) / n_dot_l)


def shares(facing: float, creases: Sequence[Lobe], weights: Sequence[float]) -> tuple[float, float]:
    """Return the weight of the base around N in SIGNED, and of what of it keeps the sum of lobes from being negative.

    `capped` is nowhere more than its crease's slope times z; and a base has no negative color.
    """
    reserve = sum(weights[3] * -crease.up_0 for crease in creases[1:])
    base = max(0.0, facing - reserve)
    return base, facing - base
