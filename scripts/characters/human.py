# SPDX-License-Identifier: GPL-3.0-or-later
"""The painted human: a hero in a jacket, belt, gloves and boots, of about 60,000 faces, kept in human.blend.

The body is MakeHuman's base mesh and targets, released under CC0; pose, clothes, hair and paint are our own. Lengths are in meters,
Z points up, the soles are at z = 0 and the face looks to -Y. Albedos are linear RGB in the color attribute ALBEDO_ATTRIBUTE.
"""

from pathlib import Path

import bpy

HUMAN = Path(__file__).with_name("human.blend")
REGION_ATTRIBUTE = "True Diffuse Region"  # of each face: an index into REGIONS
REGIONS = ("other", "eyes", "other skin", "forehead", "cheeks", "nose", "nostrils", "ears")  # skin from the third on


def human_mesh() -> bpy.types.Mesh:
    """Return a new copy of the human's mesh, which has one empty material slot and the two attributes above."""
    with bpy.data.libraries.load(str(HUMAN)) as (_, target):
        target.meshes = ["Human"]
    return target.meshes[0]
