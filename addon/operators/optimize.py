# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators that remove from the file's materials what its scenes do not need, and restore it."""

import bpy

from ..blender.id_properties import SPECIALIZED_FOR
from .base import Operator


class TRUE_DIFFUSE_OT_optimize(Operator):
    """Make all True Diffuse materials of the file render with fewer nodes and closures; picture and settings stay the same"""

    bl_idname = "true_diffuse.optimize"
    bl_label = "Optimize Materials"

    @classmethod
    def obstacle(cls, _context: bpy.types.Context) -> str:
        from ..optimize.materials import group_nodes

        return "The file has no True Diffuse material" if next(iter(group_nodes()), None) is None else ""

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..optimize.materials import optimize_materials, remove_unused, rows

        results = optimize_materials()
        remove_unused()
        for row in rows(results):
            print("  ".join(row))
        leaner = sum(bool(result.left_out) for result in results)
        message = f"Optimized {leaner} of {len(results)} materials"
        alone = [f"{result.owner} left alone: {result.problem}" for result in results if result.problem]
        if alone:
            self.report({"WARNING"}, f"{message}; {alone[0]}{' (and others)' if alone[1:] else ''}")
        else:
            self.report({"INFO"}, message)
        return {"FINISHED"}


class TRUE_DIFFUSE_OT_restore(Operator):
    """Restore what Optimize Materials removed from the file's True Diffuse materials"""

    bl_idname = "true_diffuse.restore"
    bl_label = "Restore Materials"

    @classmethod
    def obstacle(cls, _context: bpy.types.Context) -> str:
        return "" if any(SPECIALIZED_FOR in tree for tree in bpy.data.node_groups) else "No material is optimized"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..optimize.materials import restore_materials

        self.report({"INFO"}, f"Restored {restore_materials()} materials")
        return {"FINISHED"}


CLASSES = (TRUE_DIFFUSE_OT_optimize, TRUE_DIFFUSE_OT_restore)
