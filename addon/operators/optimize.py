# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that remove from the file's materials what its scenes do not need, and restore it."""

import bpy

from ..blender.id_properties import SPECIALIZED_FOR


class TRUE_DIFFUSE_OT_optimize(bpy.types.Operator):
    """Make all True Diffuse materials of the file render with fewer nodes and closures; picture and settings stay the same"""

    bl_idname = "true_diffuse.optimize"
    bl_label = "Optimize Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        from ..optimize.materials import group_nodes

        has_nodes = any(True for _ in group_nodes())
        if not has_nodes:
            cls.poll_message_set("The file has no True Diffuse material")
        return has_nodes

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..optimize.materials import optimize_materials, remove_unused, rows, total

        results = optimize_materials()
        remove_unused()
        for row in rows(results):
            print("  ".join(row))
        before, after = total(results, "before"), total(results, "after")
        alone = [result for result in results if result.after is None]
        nodes, closures = before.nodes - after.nodes, before.closures - after.closures
        message = f"Removed {nodes} of {before.nodes} nodes and {closures} of {before.closures} closures"
        if alone:
            self.report({"WARNING"}, f"{message}; {alone[0].owner} {alone[0].reasons[0]}" + (" (and others)" if alone[1:] else ""))
        else:
            self.report({"INFO"}, message)
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_restore(bpy.types.Operator):
    """Restore what Optimize Materials removed from the file's True Diffuse materials"""

    bl_idname = "true_diffuse.restore"
    bl_label = "Restore Materials"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, _context: bpy.types.Context) -> bool:
        optimized = any(SPECIALIZED_FOR in tree for tree in bpy.data.node_groups)
        if not optimized:
            cls.poll_message_set("No material is optimized")
        return optimized

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..optimize.materials import restore_materials

        self.report({"INFO"}, f"Restored {restore_materials()} materials")
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_optimize, TRUE_DIFFUSE_OT_restore)
