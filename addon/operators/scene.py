# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that builds the paper's comparison with the artist's own object."""

import bpy

from .base import Operator

ALBEDO = 0.8
SIZE = (1280, 480)  # pixels


class TRUE_DIFFUSE_OT_build_comparison(Operator):
    """Build a new scene with five copies of the active object, from standard specular through Lambert to rough Oren-Nayar"""

    bl_idname = "true_diffuse.build_comparison"
    bl_label = "Build Comparison Scene"

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        if context.active_object is None or context.active_object.type != "MESH":
            return "Make a mesh object the active one"
        return "Switch to Object Mode" if context.mode != "OBJECT" else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ...scenes import five_characters, subject

        try:
            mesh = subject.from_object(context.active_object, context.evaluated_depsgraph_get())
        except ValueError as error:
            return self.cancel_with(error)
        scene = five_characters.build(mesh, ALBEDO, False, SIZE).scene
        scene.render.engine = context.scene.render.engine
        if context.window:  # a script may have none
            context.window.scene = scene
        self.report({"INFO"}, f"{scene.name} is a new scene; the old scene has not changed")
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_build_comparison,)
