# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that chooses the lamps of the mode Lamps."""

import bpy


class TRUE_DIFFUSE_OT_choose_lamps(bpy.types.Operator):
    """Make the selected lights, or all of the scene if none is selected, the ones that the mode Lamps is exact for"""

    bl_idname = "true_diffuse.choose_lamps"
    bl_label = "Choose Lamps"
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
        self.report({"INFO"}, f"Mode Lamps follows {', '.join(light.name for light in lights)}")
        if chosen_lights.LIGHTS.trees(linked=True):
            self.report({"WARNING"}, "Materials linked from other files keep the lamps chosen there")
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_toggle_lamp(bpy.types.Operator):
    """Let the mode Lamps follow this light, or no longer"""

    bl_idname = "true_diffuse.toggle_lamp"
    bl_label = "Toggle Lamp"
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
            self.report({"ERROR"}, f"The mode Lamps follows up to {chosen_lights.SLOTS} lights: take another off the list first")
            return {"CANCELLED"}
        chosen_lights.choose(chosen)
        return {"FINISHED"}


def _lights(context: bpy.types.Context) -> list[bpy.types.Object]:
    selected = [item for item in context.selected_objects if item.type == "LIGHT"]
    return selected or [item for item in context.scene.objects if item.type == "LIGHT"]


CLASSES = (TRUE_DIFFUSE_OT_choose_lamps, TRUE_DIFFUSE_OT_toggle_lamp)
