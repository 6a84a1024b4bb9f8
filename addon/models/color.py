# SPDX-License-Identifier: GPL-3.0-or-later
"""The luminance of linear Rec. 709 colors, in which Blender, USD and glTF keep theirs."""

LUMINANCE = (0.2126, 0.7152, 0.0722)  # weights of red, green and blue, ITU-R BT.709; Blender makes a number of a color by them
