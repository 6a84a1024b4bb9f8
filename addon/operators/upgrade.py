# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that upgrades the groups of an older file."""

import bpy

from .base import Operator


class TRUE_DIFFUSE_OT_upgrade(Operator):
    """Replace node groups of an older True Diffuse by those of this version; values, links and animation stay"""

    bl_idname = "true_diffuse.upgrade"
    bl_label = "Upgrade Groups"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..material import upgrade

        report = upgrade.upgrade()
        names = report.upgraded
        self.report_with_notes(f"Upgraded {', '.join(names)}" if names else "No group was upgraded", report.lines)
        return {"FINISHED"} if names else {"CANCELLED"}


CLASSES = (TRUE_DIFFUSE_OT_upgrade,)
