# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that choose the lights that the quality Exact for Chosen Lights is exact for."""

import bpy

from ..blender.wording import counted_names
from .base import Operator


class TRUE_DIFFUSE_OT_use_selected_lights(Operator):
    """Make Exact for Chosen Lights exact for the selected lights, or for all lights of the scene if none is selected"""

    bl_idname = "true_diffuse.use_selected_lights"
    bl_label = "Use Selected Lights"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        from ..nodes.chosen_lights import SLOTS

        lights = _lights(context)
        if not lights:
            return "The scene has no light"
        return f"Select up to {SLOTS} lights" if len(lights) > SLOTS else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..nodes import chosen_lights

        lights = _lights(context)
        chosen_lights.choose(lights)
        self.report({"INFO"}, f"Chose {counted_names([light.name for light in lights], 'light')}")
        if chosen_lights.LIGHTS.trees(linked=True):
            self.report({"WARNING"}, "Materials linked from other files keep the lights chosen there")
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_toggle_light(Operator):
    """Add this light to the chosen lights, or remove it"""

    bl_idname = "true_diffuse.toggle_light"
    bl_label = "Toggle Light"

    light: bpy.props.StringProperty(name="Light", description="Name of the light object")  # ty: ignore[invalid-type-form]

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..nodes import chosen_lights

        light = context.scene.objects.get(self.light)
        if light is None or light.type != "LIGHT":
            return self.cancel_with(f"The scene has no light {self.light}")
        chosen = chosen_lights.chosen()
        is_added = light not in chosen
        if not is_added:
            chosen.remove(light)
        elif len(chosen) < chosen_lights.SLOTS:
            chosen.append(light)
        else:
            return self.cancel_with(f"At most {chosen_lights.SLOTS} lights can be chosen: remove another first")
        chosen_lights.choose(chosen)
        now = f"chosen now: {', '.join(item.name for item in chosen)}" if chosen else "no light is chosen now"
        self.report({"INFO"}, f"{'Added' if is_added else 'Removed'} {light.name}; {now}")
        return {"FINISHED"}


def _lights(context: bpy.types.Context) -> list[bpy.types.Object]:
    selected = [item for item in context.selected_objects if item.type == "LIGHT"]
    return selected or [item for item in context.scene.objects if item.type == "LIGHT"]


CLASSES = (TRUE_DIFFUSE_OT_use_selected_lights, TRUE_DIFFUSE_OT_toggle_light)
