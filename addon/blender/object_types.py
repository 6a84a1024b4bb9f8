# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender's types of objects."""

WITH_FACES = frozenset({"MESH", "CURVE", "SURFACE", "FONT", "META"})
"""Types of objects that have faces or become them, and so show materials."""
