# SPDX-License-Identifier: GPL-3.0-or-later
"""Equation (1) written in several ways, and Lambert's law beside it: GLSL to count, to time and to draw with. No bpy."""

import re
from dataclasses import dataclass

from true_diffuse.addon.models import OrenNayar
from true_diffuse.addon.realtime.models import Constants, GlslModel, Numbers

# What one operator or function stands for; a dot product of three components is three products and two sums.
OPERATIONS = {"+": 1, "-": 1, "*": 1, "/": 1, "?": 1, "max": 1, "min": 1, "sqrt": 1, "dot": 5}
ARGUMENTS = "vec3 n, vec3 l, vec3 e, float sigma, float a, float b, float rho_over_pi"

COSINES = "float l_dot_n = dot(n, l); float e_dot_n = dot(n, e);"
COEFFICIENTS = "float s2 = sigma * sigma; a = 1.0 - 0.5 * s2 / (s2 + 0.33); b = 0.45 * s2 / (s2 + 0.09);"
SHARE = "float share = min(1.0, l_dot_n / e_dot_n);"
S = "float s = dot(e, l) - e_dot_n * l_dot_n;"
RESULT = "return rho_over_pi * (a * l_dot_n + b * max(0.0, s) * share);"


@dataclass(frozen=True)
class Form:
    """A way to write one reflection: the body of a GLSL function of n, l, e, sigma, a, b and rho_over_pi."""

    name: str
    body: str

    def operations(self) -> int:
        """Return the arithmetic operations of one evaluation."""
        tokens = re.findall(r"[A-Za-z_]\w*|\d+\.\d+|[-+*/?]", self.body)
        return sum(OPERATIONS.get(token, 0) for token in tokens)

    def function(self) -> str:
        """Return the GLSL function `form`."""
        return f"float form({ARGUMENTS}) {{ {self.body} }}"


FORMS = (
    Form("Lambert", "return rho_over_pi * dot(n, l);"),
    Form(
        "equation (1) as printed (with the right minimum)",
        COSINES + COEFFICIENTS + "float root = sqrt((1.0 - l_dot_n * l_dot_n) * (1.0 - e_dot_n * e_dot_n));"
        "float s = (dot(e, l) - e_dot_n * l_dot_n) / root;"
        + SHARE
        + "return rho_over_pi * (a * l_dot_n + b * root * max(0.0, s) * share);",
    ),
    Form("simplified: the roots cancel", COSINES + COEFFICIENTS + S + SHARE + RESULT),
    Form("simplified, A and B ahead", COSINES + S + SHARE + RESULT),
)


def _constants(inputs: Numbers) -> Constants:
    return *OrenNayar(inputs["Roughness"]).constants, inputs["Roughness"]


def glsl_form(form: Form) -> GlslModel:
    """Return `form` as a model of the realtime engine, black where light is behind the surface; it reflects a sky as Lambert."""
    shape = "inputs.shape.z, inputs.shape.x, inputs.shape.y"
    radiance = f"albedo * max(0.0, form(n, l, v, {shape}, 0.318309886183791))"
    return GlslModel("geometry", "", radiance, "albedo", _constants, more=form.function())
