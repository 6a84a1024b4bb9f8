# SPDX-License-Identifier: GPL-3.0-or-later
"""The extension as Blender knows it: its name among the add-ons, whether it is installed as one, and its preferences."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import bpy

MANIFEST = Path(__file__).resolve().parents[2] / "blender_manifest.toml"
PACKAGE = (__package__ or "").removesuffix(".addon.blender")  # bl_ext.REPOSITORY.true_diffuse; true_diffuse in a checkout
IS_INSTALLED = PACKAGE.startswith("bl_ext.")


def preferences() -> bpy.types.AddonPreferences | None:
    """Return the extension's preferences, None where it is not an enabled add-on: in a script of a checkout."""
    addon = bpy.context.preferences.addons.get(PACKAGE)
    return addon.preferences if addon else None


@cache
def manifest() -> dict[str, Any]:
    """Return what the package's manifest states."""
    return tomllib.loads(MANIFEST.read_text(encoding="utf-8"))


def version() -> str:
    """Return the version that the package's manifest states."""
    return manifest()["version"]


def website() -> str | None:
    """Return the address of the manual's pages that the package's manifest states, None where it states none."""
    return manifest().get("website")


def user_folder() -> Path:
    """Return the folder for what the extension keeps for this user, which may not exist; of a checkout one beside settings."""
    if IS_INSTALLED:
        return Path(bpy.utils.extension_path_user(PACKAGE))
    return Path(bpy.utils.user_resource("CONFIG", path=PACKAGE))
