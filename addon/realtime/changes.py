# SPDX-License-Identifier: GPL-3.0-or-later
"""What Blender says has changed since the last update of a depsgraph, so that nothing else has to be looked at."""

from dataclasses import dataclass, field

import bpy


@dataclass
class Changes:
    """What an update names. Numbers are session_uids of the originals.

    `geometry`: of objects and of their data. `materials`, and in `shaded` the objects that Blender tags with them or for their
    settings: both evaluated. `images`: full names. `moves`, `lights`: whether anything moved, and whether a light changed. `scene`:
    whether what scene, view layer, collections or world hold may have changed. `is_empty`: whether nothing is named.
    """

    geometry: set[int] = field(default_factory=set)
    materials: dict[int, bpy.types.Material] = field(default_factory=dict)
    shaded: list[bpy.types.Object] = field(default_factory=list)
    images: set[str] = field(default_factory=set)
    moves: bool = False
    lights: bool = False
    scene: bool = False

    is_empty: bool = True

    @classmethod
    def of(cls, depsgraph: bpy.types.Depsgraph) -> "Changes":
        """Return what `depsgraph.updates` names: a selection, say, is of the scene and no more."""
        found = cls()
        for update in depsgraph.updates:
            item = update.id
            found.is_empty = False
            found.moves |= update.is_updated_transform or update.is_updated_geometry
            if isinstance(item, bpy.types.Object):
                found.lights |= item.type == "LIGHT"
                if update.is_updated_geometry:
                    found.geometry.add(item.original.session_uid)
                elif update.is_updated_shading:
                    found.shaded.append(item)
            elif isinstance(item, bpy.types.Material):
                found.materials[item.original.session_uid] = item
            elif isinstance(item, bpy.types.Image):
                found.images.add(item.name_full)
            elif isinstance(item, bpy.types.Light):
                found.lights = True
            elif isinstance(item, (bpy.types.Scene, bpy.types.World, bpy.types.Collection)):
                found.scene = True
            elif update.is_updated_geometry:
                found.geometry.add(item.original.session_uid)
        return found
