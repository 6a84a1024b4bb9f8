# SPDX-License-Identifier: GPL-3.0-or-later
"""Chooses qualities and sample counts for the True Diffuse materials of an artist's scene from a report, and sets them."""

from collections.abc import Callable, Mapping
from typing import Any

import bpy

from ..blender.engines import CYCLES, EEVEE, REALTIME, uses_osl
from ..closures.quality import CHOSEN_LIGHTS
from ..material.materials import locked_reason, materials_of
from ..material.read import group_node
from ..material.summary import MaterialSummary, engine_of, material_summary
from ..nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE
from .tolerance import Choice, ToleranceError, choose

SCENES = ("face", "five", "sphere")  # of a report; that most like an artist's first, the face being for Subsurface

type Choices = dict[bpy.types.Material, Choice]


def choose_all(
    scene: bpy.types.Scene, report_of: Callable[[MaterialSummary], Mapping[str, Any]], tolerance: float
) -> tuple[Choices, list[str]]:
    """Return the fastest choice for each material of `scene` with an error up to `tolerance`, and a message for each without.

    `report_of` returns the report to choose from for a material; `tolerance` is a fraction, 0.01 for 1 %.
    """
    choices, problems = {}, []
    for material in materials_of(scene):
        summary = material_summary(material)
        if summary is None or summary.group == SPECULAR_GROUP.key:  # of which no report has curves
            continue
        try:
            choices[material] = _choice(scene, report_of(summary), summary, tolerance)
        except ToleranceError as error:
            problems.append(f"{material.name}: {error}")
    return choices, problems


def apply(scene: bpy.types.Scene, choices: Choices) -> tuple[int, list[str]]:
    """Set the qualities, and as samples the largest count; returns that and the names of materials that cannot be edited."""
    samples = max(choice.samples for choice in choices.values())
    engine = engine_of(scene)
    if engine is EEVEE:
        scene.eevee.taa_render_samples = samples
    elif engine is REALTIME:
        scene.true_diffuse.samples = samples
    else:
        scene.cycles.samples, scene.cycles.use_adaptive_sampling = samples, False  # as in the report
    return samples, [material.name for material, choice in choices.items() if not _set_quality(material, choice)]


def _choice(scene: bpy.types.Scene, report: Mapping[str, Any], summary: MaterialSummary, tolerance: float) -> Choice:
    """Return the choice for one material; raises ToleranceError. Only the artist can choose Exact for Chosen Lights."""
    is_subsurface = summary.group == SUBSURFACE.key
    engine = engine_of(scene)
    if engine is None:
        raise ToleranceError("only EEVEE, Cycles and Realtime are known")
    group = ROUGH_DIFFUSE.key if summary.group == PRINCIPLED.key else summary.group
    known = {curve["scene"] for curve in report["curves"] if curve["model"] == summary.label and curve["group"] == group}
    return choose(
        report,
        next((name for name in SCENES if name in known), SCENES[1]),
        engine.key,
        summary.label,
        tolerance,
        roughness=0.0 if is_subsurface else summary.number(summary.socket("Roughness")),
        group=group,
        osl=engine is CYCLES and uses_osl(scene) and not is_subsurface,
        excluded=() if summary.follows_lights else (CHOSEN_LIGHTS,),
    )


def _set_quality(material: bpy.types.Material, choice: Choice) -> bool:
    """Set the group's Quality, or in Cycles its Method, if there is one; returns whether the material can be edited."""
    group = group_node(material)
    if group is None or locked_reason(material):
        return False
    inputs = group[0].inputs
    if choice.quality is None:
        return True
    if "Quality" in inputs:
        inputs["Quality"].default_value = choice.quality
    elif choice.engine == CYCLES.key:  # EEVEE has one method, whatever the menu says
        inputs["Method"].default_value = choice.quality
    return True
