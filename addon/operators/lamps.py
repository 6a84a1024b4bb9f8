# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that chooses the lamps of the mode Lamps."""

import bpy

from ..nodes import lamps


class TRUE_DIFFUSE_OT_choose_lamps(bpy.types.Operator):
    """Make the selected lights, or all of the scene if none is selected, the ones that the mode Lamps is exact for"""

    bl_idname = "true_diffuse.choose_lamps"
    bl_label = "Choose Lamps"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        lights = _lights(context)
        if not lights:
            cls.poll_message_set("The scene has no light")
        elif len(lights) > lamps.SLOTS:
            cls.poll_message_set(f"Select up to {lamps.SLOTS} lights")
        return 0 < len(lights) <= lamps.SLOTS

    def execute(self, context: bpy.types.Context) -> set[str]:
        lights = _lights(context)
        lamps.choose(lights)
        self.report({"INFO"}, f"Mode Lamps follows {', '.join(light.name for light in lights)}")
        if lamps.LAMPS.trees(linked=True):
            self.report({"WARNING"}, "Materials linked from other files keep the lamps chosen there")
        return {"FINISHED"}


def _lights(context: bpy.types.Context) -> list[bpy.types.Object]:
    selected = [item for item in context.selected_objects if item.type == "LIGHT"]
    return selected or [item for item in context.scene.objects if item.type == "LIGHT"]


CLASSES = (TRUE_DIFFUSE_OT_choose_lamps,)
