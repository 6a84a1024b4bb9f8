# SPDX-License-Identifier: GPL-3.0-or-later
"""Functions that Blender calls when a file changes; they import nothing heavy, as they are called often."""
