# SPDX-License-Identifier: GPL-3.0-or-later
"""Describes what was left out of an optimized node, and why."""

from collections.abc import Iterator

from ..models import by_label
from ..models.registry import CyclesClosures
from ..nodes import PRINCIPLED, SPECULAR_GROUP, SUBSURFACE
from ..nodes.principled import DIFFUSE_ROUGHNESS
from .folding import NEGLIGIBLE, Use

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
MOST_NAMED = 5  # inputs in one phrase


def reasons(key: str, use: Use) -> Iterator[str]:
    """Yield a phrase for each part of the group of that `key` that `use` does not need."""

    def number(name: str) -> float | None:
        value = use.inputs.get(name)
        return value if isinstance(value, float) else None

    model = None if key == SPECULAR_GROUP.key else by_label(use.inputs["Model"])
    if use.eevee is not None and key != SPECULAR_GROUP.key:
        yield "Cycles' closures" if use.eevee else "EEVEE's closures"
    if model and not use.eevee:
        if use.osl is False:
            yield "OSL, which no scene uses"
        elif model.cycles is CyclesClosures.DIFFUSE:
            yield f"OSL, as the closures of {model.label} are exact"
    weight, specular, roughness = (
        number("Subsurface"),
        number("Specular"),
        number(ROUGHNESS_OF.get(key, "Roughness")),
    )
    if key == SUBSURFACE.key:
        if weight is not None and weight < NEGLIGIBLE:
            yield "scattering (Subsurface is 0)"
        if weight is not None and weight > 1.0 - NEGLIGIBLE:
            yield "rough reflection (Subsurface is 1)"
        if specular is not None and specular < NEGLIGIBLE:
            yield "coat (Specular is 0)"
    if roughness is not None and roughness < NEGLIGIBLE and model and model.is_rough:
        yield "lobes (Roughness is 0: one Lambert closure)"
    if key == PRINCIPLED.key and (without := [layer for name, layer in LAYERS.items() if number(name) == 0.0]):
        yield f"layers of weight 0 ({', '.join(without)})"
    color = use.inputs.get("Color")
    if isinstance(color, tuple) and max(color) < NEGLIGIBLE:
        yield "diffuse closures (Color is black)"
    dark = [str(slot) for slot, shines in enumerate(use.shining, 1) if not shines]
    if dark:
        yield f"lights {', '.join(dark)} (none shines there)"
    constant = [name for name, value in use.inputs.items() if not isinstance(value, str) and name != "Normal"]
    if constant:
        yield f"arithmetic on {', '.join(constant) if len(constant) <= MOST_NAMED else f'{len(constant)} constant inputs'}"
