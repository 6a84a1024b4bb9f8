# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: thin wrappers that hand the work to the library."""

import bpy

from . import add, assets, convert, exports, lights, measure, presets, scene, tolerance, upgrade

MODULES = (add, presets, lights, convert, assets, scene, measure, exports, tolerance, upgrade)

register, unregister = bpy.utils.register_classes_factory([operator for module in MODULES for operator in module.CLASSES])
