# SPDX-License-Identifier: GPL-3.0-or-later
"""The asset library: a material of each preset and of each node group, with pictures, in Blender's Asset Browser.

The groups themselves are no assets: Blender would list them in the Shader Editor's Add menu beside ours, and its search twice.

Another Blender builds it from code when the user asks for it: the open file does not change, the shaders are those of this Blender,
and the package need not contain the library.
"""

import shutil
import subprocess
import tempfile
from pathlib import Path

import bpy

from ..blender.asset_library import CATALOG_FILE, FILE, NAME, VERSION_FILE, add_entry, remove_entry
from ..blender.engines import another_blender
from ..blender.extension import version
from ..nodes import GROUPS
from . import materials
from .apply_preset import create_material
from .presets import EXAMPLES, PRESETS, picture

SECONDS = 300  # for another Blender to start and write; it takes some 5
# Assets refer to their catalog by UUID: never to change. The first is the parent of the others
CATALOG = "edf3a7c9-4aa3-4d11-9d10-74f0a2fe9b18"
CATALOGS = {
    "Matte": "177c47a7-8a42-4e5f-bb5e-2f5b6d8cc6fb",
    "Skin": "09d77d29-734a-4949-b55a-76ca822f8e76",
    "Translucent": "ace95597-95d6-476c-8e30-ea2a78c85a2e",
    "Basic": "8aa8c868-2b93-4bbc-a0ed-aaa255793197",
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


def add(folder: Path) -> None:
    """Write the library to `folder`, replacing an older one, and add its entry; raises AssetError where that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix=".new_", dir=folder) as new:
            _write_in_another_blender(Path(new))
            (Path(new) / VERSION_FILE).write_text(version(), encoding="utf-8")
            for name in (FILE, CATALOG_FILE, VERSION_FILE):
                (Path(new) / name).replace(folder / name)
    except OSError as error:
        raise AssetError(f"Cannot write to {folder}: {error.strerror}") from error
    add_entry(folder)


def remove(folder: Path) -> None:
    """Remove the library at `folder` and its entry; materials in use stay in their files."""
    remove_entry(folder)
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
    made: set[bpy.types.ID] = set()
    for preset in PRESETS.values():
        made.add(_mark(create_material(preset), preset.kind, preset.description, preset.group.label, preset.picture))
    for group in GROUPS:
        inputs = EXAMPLES.get(group.key, {})
        material = materials.create(group.label, group, **inputs)
        material.diffuse_color = inputs.get("Base Color", inputs.get("Color", material.diffuse_color))
        made.add(_mark(material, "Basic", group.description, group.label, picture(group.key)))
    bpy.data.libraries.write(str(folder / FILE), made, compress=True)
    lines = ["VERSION 1", f"{CATALOG}:{NAME}:{NAME}"]
    lines += [f"{uuid}:{NAME}/{name}:{NAME}-{name}" for name, uuid in CATALOGS.items()]
    (folder / CATALOG_FILE).write_text("\n".join(lines) + "\n", encoding="utf-8")


def _mark(material: bpy.types.Material, catalog: str, description: str, group: str, image: Path) -> bpy.types.Material:
    """Make `material` an asset; returns it."""
    material.asset_mark()
    asset = material.asset_data
    asset.catalog_id = CATALOGS[catalog]
    asset.description, asset.author, asset.license = description, "True Diffuse developers", "GPL-3.0-or-later"
    for tag in (NAME, catalog, group):
        asset.tags.new(tag, skip_if_exists=True)
    with bpy.context.temp_override(id=material):
        bpy.ops.ed.lib_id_load_custom_preview(filepath=str(image))
    return material
