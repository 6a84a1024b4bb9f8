# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as Blender knows it: its name among the add-ons, and its preferences."""

import bpy

PACKAGE = (__package__ or "").removesuffix(".addon.blender")  # bl_ext.REPOSITORY.true_diffuse; true_diffuse in a checkout
ASSET_FILE = "true_diffuse.blend"  # of the asset library


def preferences() -> bpy.types.AddonPreferences | None:
    """Return the extension's preferences, None where it is not an enabled add-on: in a script of a checkout."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon else None
