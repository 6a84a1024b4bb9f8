# SPDX-License-Identifier: GPL-3.0-or-later
"""Reflectance and scattering models in plain Python floats, and the registry of the reflectance models. No bpy.

Every reflectance formula is a frozen dataclass that holds its shape parameters, folds what depends on them alone when it is made,
and offers

    radiance(n, l, v, albedo) -> float

the radiance reflected towards `v` [W/(m^2 sr)] for an irradiance E0 of 1 W/m^2 on a plane that faces the light, so f_r * (N.L).
`n`, `l`, `v` are the normal N, towards the light L, towards the viewer V (the paper's E); of any length, only the direction counts.
`albedo` is rho in [0, 1]. Light or viewer below the surface (N.L <= 0 or N.V <= 0) and vectors without a direction give 0. Every
parameter outside its range is clamped to it, and NaN counts as the lowest value: the radiance is always finite and never negative.

    Lambert, OrenNayar, Specular    the paper's five characters; OrenNayar is equation (1), the short form of OrenNayar1994
    Fujii, Eon, CyclesDiffuse       the same idea, made to keep its energy: Cycles' Diffuse BSDF and what it comes from
    Wolff                           light that passes a smooth dielectric boundary on its way in and out
    Pitted                          a rough surface whose reflectance, interreflection included, has an exact closed form

A module of this package that has a `MODEL`, a `ReflectanceModel`, is registered in MODELS: all but Specular, which is a node group
of its own.

Subsurface scattering has its own modules, as light comes out elsewhere than it went in; lengths in mm, coefficients in mm^-1:

    medium, skin     coefficients and the lengths that follow; twelve measured media; tones of skin
    dipole, burley   profiles over the distance r, and what they integrate to
    half_space       what a half-space reflects, exactly, and the way back

Paper: S. Kim and M. Lee, "Surface Model and Scattering Analysis for Realistic Game Character" (2021).
"""

from importlib import import_module
from pkgutil import iter_modules

from .blinn_phong import Specular
from .cycles_diffuse import CyclesDiffuse
from .eon import Eon
from .fujii import Fujii
from .lambert import Lambert
from .oren_nayar import OrenNayar
from .oren_nayar_1994 import OrenNayar1994
from .pitted import Pitted
from .protocol import Formula, Model
from .quadrature import average_albedo, directional_albedo
from .registry import MODELS, ReflectanceModel, by_formula, by_label, by_number, register, unregister
from .wolff import Wolff

for _module in iter_modules(__path__):
    _model = getattr(import_module(f"{__package__}.{_module.name}"), "MODEL", None)
    if _model is not None:
        register(_model)
