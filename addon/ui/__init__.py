# SPDX-License-Identifier: GPL-3.0-or-later
"""Menus, panels and plots."""

from . import kept, menus, online_manual, panels, plots

MODULES = (kept, menus, plots, panels, online_manual)


def register() -> None:
    for module in MODULES:
        module.register()


def unregister() -> None:
    for module in reversed(MODULES):
        module.unregister()
