# SPDX-License-Identifier: GPL-3.0-or-later
"""Our materials in glTF, through Blender's exporter."""
