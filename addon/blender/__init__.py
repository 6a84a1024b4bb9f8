# SPDX-License-Identifier: GPL-3.0-or-later
"""Thin covers of Blender: render engines, properties of scenes, animation curves, the sources of its GLSL and OSL shaders."""
