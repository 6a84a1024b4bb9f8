# SPDX-License-Identifier: GPL-3.0-or-later
"""The subjects of the comparisons: the painted human, Blender's monkey, or the meshes of a file; and the face's scene."""
