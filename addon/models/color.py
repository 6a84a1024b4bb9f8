# SPDX-License-Identifier: GPL-3.0-or-later
"""The luminance of linear Rec. 709 colors, in which Blender, USD and glTF keep theirs."""

# Weights of red, green and blue: Y of the primaries of ITU-R BT.709 with its white point D65, of which the standard prints four
# digits. Blender makes a number of a color by them.
LUMINANCE = (0.21263901, 0.71516868, 0.07219231)
