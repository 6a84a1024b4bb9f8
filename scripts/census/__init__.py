# SPDX-License-Identifier: GPL-3.0-or-later
"""What becomes of the materials of people's assets in every target.

values.py     what feeds a channel of a material: a factor times images times color attributes, or more. No bpy
features.py   what a material has, by a walk of Blender's nodes of its own, not by the code that is judged
gltf_file.py  what a glTF file holds. No bpy
usd_file.py   what a USD file holds. Needs pxr
verdict.py    whether a target kept, baked or said a channel, or lost it unsaid. No bpy
asset.py      imports, converts and exports one asset
table.py      the figures over all assets. No bpy
"""
