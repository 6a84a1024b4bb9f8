# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that builds the paper's comparison with the artist's own character."""

import bpy

from ..blender import engines
from ..blender.object_types import WITH_FACES
from ..blender.wording import counted
from .base import Operator

ALBEDO = 0.8
SIZE = (1280, 480)  # pixels


class TRUE_DIFFUSE_OT_build_comparison(Operator):
    """Build a new scene with the active object's character five times, from standard specular through Lambert to Oren-Nayar"""

    bl_idname = "true_diffuse.build_comparison"
    bl_label = "Build Comparison Scene"

    plaster: bpy.props.BoolProperty(  # ty: ignore[invalid-type-form] - how Blender declares properties
        name="Plaster",
        description="Show the active object alone, as one smooth mesh in one color, instead of the character as it is",
    )

    @classmethod
    def obstacle(cls, context: bpy.types.Context) -> str:
        if context.active_object is None or context.active_object.type not in {*WITH_FACES, "ARMATURE", "EMPTY"}:
            return "Make an object of the character the active one"
        return "Switch to Object Mode" if context.mode != "OBJECT" else ""

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ...scenes import five_characters, subject

        notes: list[str] = []
        before = set(bpy.data.scenes) | set(bpy.data.objects)
        item, depsgraph, old = context.active_object, context.evaluated_depsgraph_get(), context.scene.name
        try:
            if self.plaster:
                built = five_characters.build(subject.from_object(item, depsgraph), ALBEDO, False, SIZE)
            else:
                figure = subject.character_figure(item, depsgraph, notes.append)
                built = five_characters.build_as_is((figure,), SIZE)
        except Exception as error:
            bpy.data.batch_remove((set(bpy.data.scenes) | set(bpy.data.objects)) - before)  # nothing half built
            if isinstance(error, ValueError):
                return self.cancel_with(error)
            raise
        engines.choose(built.scene, context.scene.render.engine)
        five_characters.add_labels(built)
        built.scene.cursor.location = built.scene.camera.location  # else viewports draw it over the labels
        if context.window:  # a script may have none
            context.window.scene = built.scene
            _look_through_camera(context.window)
        message = f"Built the scene {built.scene.name} with {counted(len(built.characters), 'character')}; {old} has not changed"
        self.report_with_notes(message, [*notes, *built.notes])
        return {"FINISHED"}


def _look_through_camera(window: bpy.types.Window) -> None:
    """Have the 3D viewports of `window` show what its scene's camera does, as large as they can."""
    for area in window.screen.areas:
        if area.type != "VIEW_3D":
            continue
        space = area.spaces.active
        space.use_local_camera = False
        space.region_3d.view_perspective = "CAMERA"
        region = next(region for region in area.regions if region.type == "WINDOW")
        with bpy.context.temp_override(window=window, area=area, region=region):
            bpy.ops.view3d.view_center_camera()


CLASSES = (TRUE_DIFFUSE_OT_build_comparison,)
