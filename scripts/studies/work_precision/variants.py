# SPDX-License-Identifier: GPL-3.0-or-later
"""What is rendered: the groups' qualities and models, and what a user would pick of Blender's own instead.

All materials take their color from the mesh's paint, so that one shader serves every scene.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import bpy

from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.addon.closures.quality import BALANCED, CHOSEN_LIGHTS, FAST, PRECISE
from true_diffuse.addon.material import materials
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.probe.scenes import MEDIUM, Paint, rough_material, translucent_material
from true_diffuse.scripts.studies.rough import OTHERS, PAPER, MeasuredModel

SIGMA = 0.33  # of the paper's roughest character [radians]; Blender's own closures get it as their roughness
MM = 0.001  # m
OURS, BLENDERS = "ours", "blender"
QUALITIES: Mapping[Engine, Sequence[str | None]] = {
    EEVEE: (FAST, BALANCED, PRECISE, CHOSEN_LIGHTS),
    CYCLES: (BALANCED, CHOSEN_LIGHTS),
    REALTIME: (None,),  # it draws the model itself, whatever the quality
}
USUAL = {EEVEE: BALANCED, CYCLES: BALANCED, REALTIME: None}


@dataclass(frozen=True)
class Variant:
    """A material in an engine. `target` is the model it is held against: its own, or the one a user wanted.

    `group` is that of ours, as are `model`, `quality` and `sigma`; None where it has none. `is_extra`: with fewer sample counts.
    """

    engine: Engine
    label: str
    make: Callable[[Paint], bpy.types.Material]
    kind: str = BLENDERS
    group: str | None = None
    model: str | None = None
    quality: str | None = None
    sigma: float | None = None
    osl: bool = False
    target: MeasuredModel = PAPER
    is_extra: bool = False

    @property
    def is_duplicate(self) -> bool:
        """Whether it renders a matt surface as another variant does: EEVEE's Principled BSDF ignores its roughness, too."""
        return self.engine is EEVEE and self.kind == BLENDERS and "Lambert" not in self.label

    @property
    def slowness(self) -> float:
        """How much longer it takes than others, roughly."""
        return 3.0 if self.quality == PRECISE else 1.0

    @property
    def record(self) -> dict[str, object]:
        """What names it in a report."""
        return {
            "engine": self.engine.key,
            "osl": self.osl,
            "label": self.label,
            "kind": self.kind,
            "group": self.group,
            "model": self.model,
            "quality": self.quality,
            "sigma": self.sigma,
        }


def rough(used: Sequence[Engine], quick: bool, sunlit: bool) -> list[Variant]:
    """Return who renders a rough surface: the paper's model in every quality, then the others, then Blender's own.

    `sunlit`: by one light, which Exact for Chosen Lights needs.
    """
    found = []
    for engine, qualities in QUALITIES.items():
        if engine not in used:
            continue
        found += [_group(engine, PAPER, quality) for quality in qualities if sunlit or quality != CHOSEN_LIGHTS]
        if engine is CYCLES and compiles_osl():
            found.append(_group(engine, PAPER, BALANCED, osl=True))
        found += _own(engine)
    return found if quick else found + others(used)


def others(used: Sequence[Engine]) -> list[Variant]:
    """Return the rough models beside the paper's, in Balanced quality where there is a choice, each against its own formula."""
    return [_group(engine, measured, USUAL[engine], is_extra=True) for engine in used for measured in OTHERS if measured.is_rough]


def _group(engine: Engine, measured: MeasuredModel, quality: str | None, osl: bool = False, is_extra: bool = False) -> Variant:
    def make(paint: Paint) -> bpy.types.Material:
        return rough_material(measured.name, SIGMA, quality, paint)

    label = ", ".join(
        part for part in ("Rough Diffuse", "OSL" if osl else quality, None if measured is PAPER else measured.name) if part
    )
    return Variant(engine, label, make, OURS, ROUGH_DIFFUSE.key, measured.name, quality, SIGMA, osl, measured, is_extra)


def _own(engine: Engine) -> list[Variant]:
    """Return Blender's own. EEVEE's Diffuse BSDF ignores its roughness, so there it is Lambert, as it is at 0 in Realtime."""

    def diffuse(roughness: float) -> Callable[[Paint], bpy.types.Material]:
        def make(paint: Paint) -> bpy.types.Material:
            material, node = materials.create_plain("Diffuse BSDF")
            node.inputs["Roughness"].default_value = roughness
            paint(material, node.inputs["Color"])
            return material

        return make

    if engine is REALTIME:
        return [Variant(engine, "Diffuse BSDF (Lambert)", diffuse(0.0))]
    principled = Variant(engine, "Principled BSDF", lambda paint: _principled(paint, {"Diffuse Roughness": SIGMA}))
    if engine is EEVEE:
        return [Variant(engine, "Diffuse BSDF (Lambert)", diffuse(SIGMA)), principled]
    return [Variant(engine, "Diffuse BSDF", diffuse(SIGMA)), principled, Variant(engine, "Lambert", diffuse(0.0))]


def _principled(paint: Paint, inputs: dict[str, materials.Setting]) -> bpy.types.Material:
    """Return a matt Principled BSDF."""
    material, node = materials.create_plain("Principled BSDF")
    tree = material.node_tree
    tree.nodes.remove(node)
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    materials.set_inputs(node, {"Specular IOR Level": 0.0, "Roughness": 1.0} | inputs)
    tree.links.new(node.outputs["BSDF"], tree.get_output_node("ALL").inputs["Surface"])
    paint(material, node.inputs["Base Color"])
    return material


def translucent(used: Sequence[Engine], quick: bool) -> list[Variant]:
    """Return who renders skin: the group in every method (of Cycles alone), the Principled BSDF, plain Lambert."""
    methods = ("Random Walk", "Christensen-Burley", "Random Walk (Skin)", "Random Walk (Legacy)")
    found = []
    for engine in used:
        shown = methods[:1] if engine is not CYCLES else methods[:2] if quick else methods
        found += [_skin(engine, method) for method in shown]
        if engine is not REALTIME:
            found.append(Variant(engine, "Principled BSDF", _principled_skin))
        found += [one for one in _own(engine)[-3:] if "Lambert" in one.label]
    return found


def _skin(engine: Engine, method: str) -> Variant:
    def make(paint: Paint) -> bpy.types.Material:
        return translucent_material(method, paint)

    label = f"Subsurface, {method}" if engine is CYCLES else "Subsurface"
    quality = None if engine is REALTIME else method
    return Variant(engine, label, make, OURS, SUBSURFACE.key, "Oren-Nayar", quality)


def _principled_skin(paint: Paint) -> bpy.types.Material:
    """Return what an artist would set with the same lengths at hand: Radius is the mean free path, in units of Scale."""
    lengths = MEDIUM.inputs["Subsurface Radius"]
    return _principled(paint, {"Subsurface Weight": 1.0, "Subsurface Radius": lengths, "Subsurface Scale": MM})
