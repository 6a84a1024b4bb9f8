# SPDX-License-Identifier: GPL-3.0-or-later
"""The subjects of the comparisons: a human made of MakeHuman's data, its face, or the meshes of a file."""
