# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that leave out of the file's materials what its scenes do not need, and bring it back."""

import bpy

from ..blender.id_properties import SPECIALIZED_FOR


class TRUE_DIFFUSE_OT_simplify(bpy.types.Operator):
    """Let all True Diffuse materials of the file render by the least that gives the same picture, their settings as they are"""

    bl_idname = "true_diffuse.simplify"
    bl_label = "Simplify"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        from ..optimize.materials import group_nodes

        found = any(True for _ in group_nodes())
        if not found:
            cls.poll_message_set("The file has no True Diffuse material")
        return found

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..optimize.materials import optimize_materials, remove_unused, rows, total

        results = optimize_materials()
        remove_unused()
        for row in rows(results):
            print("  ".join(row))
        before, after, alone = (
            total(results, "before"),
            total(results, "after"),
            [result for result in results if result.after is None],
        )
        nodes, closures = before.nodes - after.nodes, before.closures - after.closures
        said = f"Left out {nodes} of {before.nodes} nodes and {closures} of {before.closures} closures"
        if alone:
            self.report({"WARNING"}, f"{said}; {alone[0].owner} {alone[0].reasons[0]}" + (" (and others)" if alone[1:] else ""))
        else:
            self.report({"INFO"}, said)
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_restore(bpy.types.Operator):
    """Give all True Diffuse materials of the file back what Simplify left out"""

    bl_idname = "true_diffuse.restore"
    bl_label = "Restore Full Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        simplified = any(SPECIALIZED_FOR in tree for tree in bpy.data.node_groups)
        if not simplified:
            cls.poll_message_set("No material is simplified")
        return simplified

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..optimize.materials import restore_materials

        self.report({"INFO"}, f"Restored {restore_materials()} materials")
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_simplify, TRUE_DIFFUSE_OT_restore)
