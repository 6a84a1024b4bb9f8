# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library among the user's asset libraries: its folder, and its entry, which is there while the extension is enabled.

Disabling the extension takes the entry out of the preferences and leaves a note of it in the folder; enabling puts back what the
note says. So an entry that the user has removed stays away. When Blender quits it disables all add-ons, too, after it has saved the
preferences (WM_exit_ex in wm_init_exit.cc): the entry stays in them.
"""

import json
from pathlib import Path

import bpy

from .extension import IS_INSTALLED, PACKAGE, version

NAME = "True Diffuse"
FILE = "true_diffuse.blend"
CATALOG_FILE = "blender_assets.cats.txt"
VERSION_FILE = "version.txt"  # holds the version of the extension that wrote the library
NOTE = "disabled.json"
KEPT = ("name", "import_method", "use_relative_path")  # settings of an entry


def folder() -> Path:
    """Return the folder for the library, in the user's own; raises ValueError in a checkout, which has none."""
    return Path(bpy.utils.extension_path_user(PACKAGE, path="assets"))


def is_current(folder: Path) -> bool:
    """Return whether this version of the extension wrote the library at `folder`."""
    path = folder / VERSION_FILE
    return path.is_file() and path.read_text(encoding="utf-8") == version()


def entry(folder: Path) -> bpy.types.UserAssetLibrary | None:
    """Return the entry of the library at `folder` among the user's asset libraries, None where there is none."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((library for library in libraries if library.path and Path(library.path) == folder), None)


def add_entry(folder: Path) -> bpy.types.UserAssetLibrary:
    """Return the library's entry, a new one where there is none."""
    library = entry(folder)
    if library is None:
        library = bpy.context.preferences.filepaths.asset_libraries.new(name=NAME, directory=str(folder))
        library.import_method = "APPEND"  # linked materials could not be edited
    return library


def remove_entry(folder: Path) -> None:
    """Remove the library's entry where there is one."""
    library = entry(folder)
    if library:
        bpy.context.preferences.filepaths.asset_libraries.remove(library)


def enable(folder: Path) -> None:
    """Put back the entry that `disable` has removed."""
    note = folder / NOTE
    try:
        settings = json.loads(note.read_text(encoding="utf-8"))
        note.unlink()
    except OSError:
        return  # no note, or a folder that nobody may change
    if (folder / FILE).is_file() and entry(folder) is None:
        library = add_entry(folder)
        for name in KEPT:
            setattr(library, name, settings[name])


def disable(folder: Path) -> None:
    """Remove the entry, and note in the library's folder that it was there."""
    library = entry(folder)
    if library is None:
        return
    if folder.is_dir():
        (folder / NOTE).write_text(json.dumps({name: getattr(library, name) for name in KEPT}), encoding="utf-8")
    remove_entry(folder)


def register() -> None:
    if IS_INSTALLED:
        enable(folder())


def unregister() -> None:
    if IS_INSTALLED:
        disable(folder())
