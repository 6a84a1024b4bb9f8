# SPDX-License-Identifier: GPL-3.0-or-later
"""What the command lines share: options, terminal, output folders, starting Blender."""
