# SPDX-License-Identifier: GPL-3.0-or-later
"""The operator that upgrades the groups of an older file."""

import bpy

from ..blender.wording import listed
from .base import Operator


class TRUE_DIFFUSE_OT_upgrade(Operator):
    """Replace node groups of an older True Diffuse by those of this version; values, links and animation stay"""

    bl_idname = "true_diffuse.upgrade"
    bl_label = "Upgrade Groups"

    @classmethod
    def obstacle(cls, _context: bpy.types.Context) -> str:
        from ..material.upgrade import is_outdated

        return "" if is_outdated() else "All groups are of this version"

    def execute(self, _context: bpy.types.Context) -> set[str]:
        from ..material import upgrade

        report = upgrade.upgrade()
        names = report.upgraded
        self.report_with_notes(f"Upgraded the groups of {listed(names)}" if names else "Upgraded no group", report.lines)
        return {"FINISHED"} if names else {"CANCELLED"}


CLASSES = (TRUE_DIFFUSE_OT_upgrade,)
