# SPDX-License-Identifier: GPL-3.0-or-later
"""Eight small characters that stand for the materials people's characters have, built in code into tests/assets.

figure.py       the mesh, as plain numbers
picture.py      the images, as PNG
gltf.py         a glTF binary file
characters.py   the eight: seven glTF files
skin.py         the eighth, a .blend file; needs bpy
"""
