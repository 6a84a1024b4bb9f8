# SPDX-License-Identifier: GPL-3.0-or-later
"""Operators: thin wrappers that hand the work to the library."""

import bpy

from . import add, lamps, presets

register, unregister = bpy.utils.register_classes_factory((*add.CLASSES, *presets.CLASSES, *lamps.CLASSES))
