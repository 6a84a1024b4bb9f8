# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes Blender's glTF exporter read stand-ins where it reads our materials, for the time of one export.

The exporter has hooks for what it has gathered, but none for the nodes that it gathers from. So for one export three of its
functions are replaced: `save`, which then makes the stand-ins, and removes them however the export ends; the constructor through
which the nodes of every material are reached; and the method that gives a mesh's attributes their names in the file. Names, custom
properties and culling are still read from the material itself, and hooks of other add-ons get it. Nothing that the user made is
changed at any time, so there is nothing to restore after an error or an interrupt. Stand-ins are data-blocks of the open file while
the export runs; making and removing them neither marks the file as changed nor makes an undo step.
"""

from collections.abc import Callable, Generator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy

from .stand_in import StandIns

if TYPE_CHECKING:
    from io_scene_gltf2.blender.exp.primitive_extract import PrimitiveCreator

ORIGINAL = "_true_diffuse_original"  # names the exporter's own function on the one in its place


def read_stand_ins(stand_ins: StandIns, make: Callable[[dict], None], note_mesh: Callable[["PrimitiveCreator"], None]) -> None:
    """Make the export that is about to run read `stand_ins`; `make` makes them, once the frame is set, by the exporter's settings.

    `note_mesh` gets what extracts each mesh, when its attributes have their names in the file. Raises AttributeError or ImportError
    where the exporter is built in another way.
    """
    from io_scene_gltf2.blender.exp import export
    from io_scene_gltf2.blender.exp.material import materials

    save, identifier = getattr(export.save, ORIGINAL, export.save), materials.BlenderMaterialIndentifier

    def save_with_stand_ins(context: bpy.types.Context, settings: dict) -> set[str]:
        export.save = save
        settings["pre_export_callbacks"].append(make)
        with _reading(stand_ins, identifier), _noting(note_mesh):
            return save(context, settings)

    setattr(save_with_stand_ins, ORIGINAL, save)
    export.save = save_with_stand_ins


@contextmanager
def _noting(note_mesh: Callable[["PrimitiveCreator"], None]) -> Generator[None]:
    from io_scene_gltf2.blender.exp.primitive_extract import PrimitiveCreator

    name_attributes = PrimitiveCreator.manage_material_info

    def name_and_note(creator: PrimitiveCreator) -> None:
        name_attributes(creator)
        note_mesh(creator)

    PrimitiveCreator.manage_material_info = name_and_note
    try:
        yield
    finally:
        PrimitiveCreator.manage_material_info = name_attributes


@contextmanager
def _reading(stand_ins: StandIns, identifier: Callable) -> Generator[None]:
    """Have the exporter reach a material's nodes through its stand-in; removes the stand-ins at the end."""
    from io_scene_gltf2.blender.exp.material import materials

    def reach(material: bpy.types.Material, settings: dict) -> object:
        stand_in = stand_ins.of(material)
        if stand_in is None:
            return identifier(material, settings)
        found = identifier(stand_in.material, settings)
        found.id, found.material, found.name = id(material), material, material.name
        return found

    materials.BlenderMaterialIndentifier = reach
    try:
        yield
    finally:
        materials.BlenderMaterialIndentifier = identifier
        stand_ins.remove()
