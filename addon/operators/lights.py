# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that choose the lights that the quality Exact for Chosen Lights is exact for."""

import bpy


class TRUE_DIFFUSE_OT_use_selected_lights(bpy.types.Operator):
    """Make Exact for Chosen Lights exact for the selected lights, or for all lights of the scene if none is selected"""

    bl_idname = "true_diffuse.use_selected_lights"
    bl_label = "Use Selected Lights"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        from ..nodes.chosen_lights import SLOTS

        lights = _lights(context)
        if not lights:
            cls.poll_message_set("The scene has no light")
        elif len(lights) > SLOTS:
            cls.poll_message_set(f"Select up to {SLOTS} lights")
        return 0 < len(lights) <= SLOTS

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..nodes import chosen_lights

        lights = _lights(context)
        chosen_lights.choose(lights)
        self.report({"INFO"}, f"Chosen lights: {', '.join(light.name for light in lights)}")
        if chosen_lights.LIGHTS.trees(linked=True):
            self.report({"WARNING"}, "Materials linked from other files keep the lights chosen there")
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_toggle_light(bpy.types.Operator):
    """Add this light to the chosen lights, or remove it"""

    bl_idname = "true_diffuse.toggle_light"
    bl_label = "Toggle Light"
    bl_options = {"REGISTER", "UNDO"}

    light: bpy.props.StringProperty(name="Light", description="Name of the light object")  # ty: ignore[invalid-type-form]

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..nodes import chosen_lights

        light = context.scene.objects.get(self.light)
        if light is None or light.type != "LIGHT":
            self.report({"ERROR"}, f"The scene has no light {self.light}")
            return {"CANCELLED"}
        chosen = chosen_lights.chosen()
        if light in chosen:
            chosen.remove(light)
        elif len(chosen) < chosen_lights.SLOTS:
            chosen.append(light)
        else:
            self.report({"ERROR"}, f"At most {chosen_lights.SLOTS} lights can be chosen: remove another first")
            return {"CANCELLED"}
        chosen_lights.choose(chosen)
        return {"FINISHED"}


def _lights(context: bpy.types.Context) -> list[bpy.types.Object]:
    selected = [item for item in context.selected_objects if item.type == "LIGHT"]
    return selected or [item for item in context.scene.objects if item.type == "LIGHT"]


CLASSES = (TRUE_DIFFUSE_OT_use_selected_lights, TRUE_DIFFUSE_OT_toggle_light)
