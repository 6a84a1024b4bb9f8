# SPDX-License-Identifier: GPL-3.0-or-later
"""The analytic truth: reflectance models in plain Python floats, without bpy and without numpy.

Every model is a frozen dataclass that holds its shape parameters, folds what depends on them alone when it is made, and offers

    radiance(n, l, v, albedo) -> float

the radiance reflected towards `v` [W/(m^2 sr)] for an irradiance E0 of 1 W/m^2 on a plane that faces the light, so f_r * (N.L).
`n`, `l`, `v` are unit vectors: the normal N, towards the light L, towards the viewer V (the paper's E). `albedo` is rho in [0, 1].
Light or viewer below the surface (N.L <= 0 or N.V <= 0) gives 0.

Paper: S. Kim and M. Lee, "Surface Model and Scattering Analysis for Realistic Game Character" (2021).
"""

from .cycles_diffuse import CyclesDiffuse
from .eon import Eon
from .fujii import Fujii
from .lambert import Lambert
from .oren_nayar import OrenNayar
from .oren_nayar_1994 import OrenNayar1994
from .protocol import Model
from .quadrature import average_albedo, directional_albedo
from .specular import Specular

__all__ = (
    "CyclesDiffuse",
    "Eon",
    "Fujii",
    "Lambert",
    "Model",
    "OrenNayar",
    "OrenNayar1994",
    "Specular",
    "average_albedo",
    "directional_albedo",
)
