# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that upgrades the groups of an older file."""

import bpy


class TRUE_DIFFUSE_OT_upgrade(bpy.types.Operator):
    """Replace node groups of an older True Diffuse by those of this version; values, links and animation stay"""

    bl_idname = "true_diffuse.upgrade"
    bl_label = "Upgrade Groups"
    bl_options = {"REGISTER", "UNDO"}

    def execute(self, context: bpy.types.Context) -> set[str]:
        from ..material import upgrade

        report = upgrade.upgrade()
        for line in report.lines:
            self.report({"WARNING"}, line)
        names = report.upgraded
        message = f"Upgraded {', '.join(names)}" if names else "No group was upgraded"
        if report.lines:
            message += f"; {report.lines[0] if len(report.lines) == 1 else f'{len(report.lines)} notes are in the Info editor'}"
        self.report({"INFO"}, message)
        return {"FINISHED"} if names else {"CANCELLED"}


CLASSES = (TRUE_DIFFUSE_OT_upgrade,)
