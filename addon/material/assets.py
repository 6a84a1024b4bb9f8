# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library: a material of each preset and the node groups, with pictures, in Blender's Asset Browser.

Another Blender builds it from code when the user asks for it: the open file does not change, the shaders are those of this Blender,
and the package need not contain the library.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import bpy

from ..blender.engines import another_blender
from ..blender.extension import ASSET_FILE, PACKAGE
from ..nodes import GROUPS
from .apply_preset import create_material
from .presets import PRESETS, picture

NAME = "True Diffuse"
CATALOG_FILE = "blender_assets.cats.txt"
SECONDS = 300  # for another Blender to start and write; it takes some 5
# Assets refer to their catalog by UUID: never to change. The first is the parent of the others
CATALOG = "edf3a7c9-4aa3-4d11-9d10-74f0a2fe9b18"
CATALOGS = {
    "Matte": "177c47a7-8a42-4e5f-bb5e-2f5b6d8cc6fb",
    "Skin": "09d77d29-734a-4949-b55a-76ca822f8e76",
    "Translucent": "ace95597-95d6-476c-8e30-ea2a78c85a2e",
    "Node Groups": "8aa8c868-2b93-4bbc-a0ed-aaa255793197",
}
WORKER = """
import importlib.util, sys
from pathlib import Path
spec = importlib.util.spec_from_file_location("true_diffuse", {init!r}, submodule_search_locations=[{root!r}])
module = sys.modules["true_diffuse"] = importlib.util.module_from_spec(spec)
spec.loader.exec_module(module)
import bpy
bpy.ops.wm.read_factory_settings(use_empty=True)
from true_diffuse.addon.material import assets
assets.write(Path({folder!r}))
"""


class AssetError(Exception):
    """The library cannot be written; the message is one line for the user."""


def folder() -> Path:
    """Return the folder for the library, in the user's own; raises ValueError in a checkout, which has none."""
    return Path(bpy.utils.extension_path_user(PACKAGE, path="assets"))


def registered(folder: Path) -> bpy.types.UserAssetLibrary | None:
    """Return the entry of the library at `folder` among the user's asset libraries, None where there is none."""
    libraries = bpy.context.preferences.filepaths.asset_libraries
    return next((library for library in libraries if library.path and Path(library.path) == folder), None)


def add(folder: Path) -> None:
    """Write the library to `folder`, replacing an older one, and register it; raises AssetError where that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".new_", dir=folder) as new:
            _write_in_another_blender(Path(new))
            for name in (ASSET_FILE, CATALOG_FILE):
                (Path(new) / name).replace(folder / name)
    except OSError as error:
        raise AssetError(f"Cannot write to {folder}: {error.strerror}") from error
    if registered(folder) is None:
        library = bpy.context.preferences.filepaths.asset_libraries.new(name=NAME, directory=str(folder))
        library.import_method = "APPEND"  # linked materials could not be edited


def remove(folder: Path) -> None:
    """Remove the library at `folder` and its entry; materials in use stay in their files."""
    library = registered(folder)
    if library:
        bpy.context.preferences.filepaths.asset_libraries.remove(library)
    shutil.rmtree(folder, ignore_errors=True)


def _write_in_another_blender(folder: Path) -> None:
    """Call `write` in another Blender; raises AssetError with the last line of its output where it fails."""
    root = Path(__file__).resolve().parents[2]
    code = WORKER.format(init=str(root / "__init__.py"), root=str(root), folder=str(folder))
    try:
        result = subprocess.run(another_blender(code), capture_output=True, text=True, timeout=SECONDS, check=False)
    except subprocess.TimeoutExpired:
        raise AssetError(f"Blender took more than {SECONDS} s to write the library") from None
    if result.returncode != 0 or not (folder / CATALOG_FILE).is_file():
        output = (result.stderr or result.stdout).strip().splitlines()
        raise AssetError(f"Blender could not write the library: {output[-1] if output else 'it gave no reason'}")


def write(folder: Path) -> None:
    """Write the library's files to `folder`; the open file gets all assets, so call this in an empty one."""
    blocks: set[bpy.types.ID] = set()
    for preset in PRESETS.values():
        material = create_material(preset)
        tags = (preset.kind, preset.group.label)
        blocks.add(_mark(material, preset.kind, preset.description, tags, preset.picture))
    for group in GROUPS:
        blocks.add(_mark(group.ensure(), "Node Groups", group.description, ("Shader",), picture(group.key)))
    bpy.data.libraries.write(str(folder / ASSET_FILE), blocks, compress=True)
    lines = ["VERSION 1", f"{CATALOG}:{NAME}:{NAME}"]
    lines += [f"{uuid}:{NAME}/{name}:{NAME}-{name}" for name, uuid in CATALOGS.items()]
    (folder / CATALOG_FILE).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _mark(block: bpy.types.ID, catalog: str, description: str, tags: tuple[str, ...], image: Path) -> bpy.types.ID:
    """Make `block` an asset; returns it."""
    block.asset_mark()
    asset = block.asset_data
    asset.catalog_id = CATALOGS[catalog]
    asset.description, asset.author, asset.license = description, "True Diffuse developers", "GPL-3.0-or-later"
    for tag in (NAME, *tags):
        asset.tags.new(tag, skip_if_exists=True)
    with bpy.context.temp_override(id=block):
        bpy.ops.ed.lib_id_load_custom_preview(filepath=str(image))
    return block
