# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's settings in the render properties, and Blender's own panels that it shows."""

import textwrap
from collections.abc import Iterator

import bpy

from . import not_drawn
from .engine import IDENTIFIER

GENERIC = "BLENDER_RENDER"  # in COMPAT_ENGINES of panels for any engine
EXCLUDED = ("freestyle", "DATA_PT_light", "DATA_PT_spot")  # in names: what the engine lacks, or EEVEE's panels show better
EEVEE_PANELS = {  # of settings that the engine follows
    "DATA_PT_EEVEE_light",
    "DATA_PT_EEVEE_light_shadow",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "RENDER_PT_eevee_film",
    "VIEWLAYER_PT_override",
}


class RenderPanel:
    """Base of the engine's panels of the Render properties."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"
    COMPAT_ENGINES = frozenset({IDENTIFIER})
    layout: bpy.types.UILayout

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES


class TRUE_DIFFUSE_PT_sampling(RenderPanel, bpy.types.Panel):
    """Samples of the realtime engine"""

    bl_label = "Sampling"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split = True
        self.layout.use_property_decorate = False
        column = self.layout.column(align=True)
        column.prop(context.scene.true_diffuse, "viewport_samples", text="Viewport")
        column.prop(context.scene.true_diffuse, "samples", text="Render")


class TRUE_DIFFUSE_PT_not_drawn(RenderPanel, bpy.types.Panel):
    """What the last picture of the realtime engine lacks, and what it shows instead"""

    bl_label = "Not Drawn"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and bool(not_drawn.messages(context.scene))

    def draw(self, context: bpy.types.Context) -> None:
        width = max(20, int(context.region.width / (7.0 * context.preferences.system.ui_scale)))  # characters of a line
        for warning in not_drawn.messages(context.scene):
            column = self.layout.column(align=True)
            for line in textwrap.wrap(warning, width):
                column.label(text=line)


PANELS = (TRUE_DIFFUSE_PT_sampling, TRUE_DIFFUSE_PT_not_drawn)


def shared_panels() -> Iterator[type[bpy.types.Panel]]:
    """Yield Blender's own panels that apply to the engine."""
    waiting = list(bpy.types.Panel.__subclasses__())
    while waiting:
        panel = waiting.pop()
        waiting += panel.__subclasses__()
        engines, name = getattr(panel, "COMPAT_ENGINES", ()), panel.__name__
        if name in EEVEE_PANELS or (GENERIC in engines and not any(word in name for word in EXCLUDED)):
            yield panel


def register() -> None:
    """Register the panels and have the engine show the shared ones."""
    for panel in PANELS:
        bpy.utils.register_class(panel)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(IDENTIFIER)


def unregister() -> None:
    """Undo `register`."""
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(IDENTIFIER)
    for panel in reversed(PANELS):
        bpy.utils.unregister_class(panel)
