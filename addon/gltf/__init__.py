# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender's glTF exporter writes of our materials."""
