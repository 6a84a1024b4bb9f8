# SPDX-License-Identifier: GPL-3.0-or-later
"""What the add-on shows in Blender."""

from . import menus

MODULES = (menus,)


def register() -> None:
    for module in MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(MODULES):
        module.unregister()
