# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: thin wrappers that hand the work to the library."""

import bpy

from . import add, assets, convert, exports, lights, measure, presets, scene, steps, tolerance, upgrade

MODULES = (add, presets, lights, convert, assets, scene, measure, exports, tolerance, upgrade)

_register_classes, _unregister_classes = bpy.utils.register_classes_factory(
    [operator for module in MODULES for operator in module.CLASSES]
)


def register() -> None:
    _register_classes()
    steps.register()


def unregister() -> None:
    steps.unregister()
    _unregister_classes()
