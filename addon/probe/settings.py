# SPDX-License-Identifier: GPL-3.0-or-later
"""Picks modes and samples for the True Diffuse materials of an artist's scene by a report, and sets them."""

from collections.abc import Mapping
from typing import Any

import bpy

from ..blender.engines import CYCLES, EEVEE, REALTIME, uses_osl
from ..closures.quality import CHOSEN_LIGHTS
from ..material.materials import materials_of, refusal
from ..material.read import group_node
from ..material.summary import Claim, claim_of, engine_of
from ..nodes import SPECULAR_GROUP, SUBSURFACE
from .tolerance import Choice, Unmet, choose

SCENES = ("face", "five", "sphere")  # of a report, the one most like an artist's first; the face for what is translucent

type Choices = dict[bpy.types.Material, Choice]


def pick(scene: bpy.types.Scene, report: Mapping[str, Any], share: float) -> tuple[Choices, list[str]]:
    """Return what is cheapest for an error of `share` for each material of `scene`, and a line for each that has no choice."""
    choices, unmet = {}, []
    for material, claim in _in_use(scene):
        try:
            choices[material] = _choice(scene, report, claim, share)
        except Unmet as error:
            unmet.append(f"{material.name}: {error}")
    return choices, unmet


def use(scene: bpy.types.Scene, choices: Choices) -> tuple[int, list[str]]:
    """Set modes, and the samples that are enough for all; returns the samples and the names of materials that cannot be edited."""
    samples = max(choice.samples for choice in choices.values())
    engine = engine_of(scene)
    if engine is EEVEE:
        scene.eevee.taa_render_samples = samples
    elif engine is REALTIME:
        scene.true_diffuse.samples = samples
    else:
        scene.cycles.samples, scene.cycles.use_adaptive_sampling = samples, False  # the report's are all taken
    return samples, [material.name for material, choice in choices.items() if not _set_mode(material, choice)]


def _in_use(scene: bpy.types.Scene) -> list[tuple[bpy.types.Material, Claim]]:
    """Return the True Diffuse materials of `scene` whose modes or methods a report knows: of Standard Specular it has none."""
    claims = ((material, claim_of(material)) for material in materials_of(scene))
    return [(material, claim) for material, claim in claims if claim and claim.group != SPECULAR_GROUP.key]


def _choice(scene: bpy.types.Scene, report: Mapping[str, Any], claim: Claim, share: float) -> Choice:
    """Return the choice for one material; raises Unmet. The mode Lamps is the artist's own to choose: the light decides."""
    is_below = claim.group == SUBSURFACE.key
    engine = engine_of(scene)
    if engine is None:
        raise Unmet("only EEVEE, Cycles and Realtime are known")
    known = {curve["scene"] for curve in report["curves"] if curve["model"] == claim.label and curve["group"] == claim.group}
    return choose(
        report,
        next((name for name in SCENES if name in known), SCENES[1]),
        engine.key,
        claim.label,
        share,
        roughness=0.0 if is_below else claim.number("Roughness"),
        group=claim.group,
        osl=engine is CYCLES and uses_osl(scene) and not is_below,
        leave_out=() if claim.follows_lamps else (CHOSEN_LIGHTS,),
    )


def _set_mode(material: bpy.types.Material, choice: Choice) -> bool:
    """Set the group's Mode, or in Cycles its Method, if there is a choice; returns whether the material can be edited."""
    found = group_node(material)
    if found is None or refusal(material):
        return False
    inputs = found[0].inputs
    if choice.mode is None:
        return True
    if "Quality" in inputs:
        inputs["Quality"].default_value = choice.mode
    elif choice.engine == CYCLES.key:  # EEVEE has one method, whatever the menu says
        inputs["Method"].default_value = choice.mode
    return True
