# SPDX-License-Identifier: GPL-3.0-or-later
"""Describes what was left out of an optimized node, and why."""

from collections.abc import Iterator

from ..models import by_label
from ..nodes import PRINCIPLED, SPECULAR_GROUP, SUBSURFACE
from ..nodes.principled import DIFFUSE_ROUGHNESS
from .folding import ZERO
from .usage import Use

ROUGHNESS_OF = {PRINCIPLED.key: DIFFUSE_ROUGHNESS.name}  # by group: the name of the models' roughness, where it is another
LAYERS = {
    "Metallic": "metal",
    "Transmission Weight": "transmission",
    "Subsurface Weight": "subsurface",
    "Coat Weight": "coat",
    "Sheen Weight": "sheen",
    "Emission Strength": "emission",
}
"""Of Principled Rough Diffuse, by their weights."""


def reasons(key: str, use: Use) -> Iterator[str]:
    """Yield a phrase for each part of the group of that `key` that `use` does not need."""
    inputs = use.inputs
    model = None if key == SPECULAR_GROUP.key else by_label(str(inputs["Model"]))
    if key == SUBSURFACE.key:
        if inputs.get("Subsurface") == 0.0:
            yield "scattering (Subsurface is 0)"
        if inputs.get("Subsurface") == 1.0:
            yield "rough reflection (Subsurface is 1)"
        if inputs.get("Specular") == 0.0:
            yield "coat (Specular is 0)"
    if key == SPECULAR_GROUP.key and inputs.get("Specular") == 0.0:
        yield "highlight (Specular is 0)"
    if model and model.is_rough and inputs.get(ROUGHNESS_OF.get(key, "Roughness")) == 0.0:
        yield "lobes (Roughness is 0: one Lambert closure)"
    layered = key == PRINCIPLED.key and model and model.parameter  # Lambert is one Principled BSDF, whatever its weights
    if layered and (without := [layer for name, layer in LAYERS.items() if inputs.get(name) == 0.0]):
        yield f"layers of weight 0 ({', '.join(without)})"
    if inputs.get("Color") == ZERO:
        yield "diffuse closures (Color is black)"
