# SPDX-License-Identifier: GPL-3.0-or-later
"""The files that a character's file needs beside itself, as Blender and OpenUSD list them: libraries, buffers, images, caches."""

import json
import os
import struct
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import bpy

USD_SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
BLENDER_FLAGS = {"SKIP_PACKED", "SKIP_WEAK_REFERENCES"}
EXPAND = {"EXPAND_TOKENS", "EXPAND_SEQUENCES", "EXPAND_CACHES"}
UDIM_COLUMNS, FIRST_UDIM = 10, 1001
GLB_MAGIC, GLB_JSON = b"glTF", b"JSON"
ENCODED = "data:"  # what a URI begins with that holds the file itself


@dataclass(frozen=True)
class Dependencies:
    """Files beside a character's: those that are there, those that are missing, and those missing that nothing shown needs."""

    files: tuple[Path, ...] = ()
    missing: tuple[str, ...] = ()
    spared: tuple[str, ...] = ()


def of_file(path: Path) -> Dependencies:
    """Return what the file itself names, in formats that name all of it; of others that is known once Blender has loaded it.

    Raises OSError, RuntimeError or ValueError where it cannot be read.
    """
    return NAMED.get(path.suffix.lower(), lambda _: Dependencies())(path)


def of_loaded(shown: Iterable[bpy.types.ID], loaded: Collection[bpy.types.ID], own: Path) -> Dependencies:
    """Return what `loaded` data-blocks need beside the file `own` they came from, and what of that is missing for those `shown`.

    Blender's own list: libraries and theirs, images with all tiles and frames, caches, fonts, sounds, volumes; nothing packed.
    """
    files: dict[Path, None] = {}
    found: set[bpy.types.ID] = set()
    missing: dict[bpy.types.ID, list[Path]] = {}

    def see(block: bpy.types.ID, path: str, about: bpy.types.bpy_struct) -> None:
        file = Path(os.path.normpath(bpy.path.abspath(path, library=block.library)))
        if file.is_file():
            files[file] = None
            found.add(block)
        elif not about.is_cache:
            missing.setdefault(block, []).append(file)

    # Libraries that something is read from, not those whose data-blocks are packed in the file.
    libraries = {block.library for block in loaded if block.library and not block.library.is_archive}
    asked = {block for block in loaded if not isinstance(block, bpy.types.Library)} | libraries
    bpy.data.file_path_foreach(see, subset=asked, flags=BLENDER_FLAGS | EXPAND)
    bpy.data.file_path_foreach(see, subset=asked, flags=BLENDER_FLAGS)  # also has tiles and frames of which there is none
    missing = {block: lost for block, lost in missing.items() if block not in found}
    for block in loaded:
        if isinstance(block, bpy.types.Image) and block.source == "TILED" and not block.packed_files:
            missing[block] = [file for file in _tiles(block) if not file.is_file()]
    needed = _used_by(shown)
    lost: dict[str, bool] = {}
    for block, names in missing.items():
        for name in map(str, names):
            lost[name] = lost.get(name, False) or block in needed or isinstance(block, bpy.types.Library)
    files.pop(own, None)
    spared = tuple(name for name, is_needed in lost.items() if not is_needed)
    return Dependencies(tuple(sorted(files)), tuple(name for name in lost if name not in spared), spared)


def _tiles(image: bpy.types.Image) -> Iterator[Path]:
    """Yield the file of each tile of an image."""
    path = bpy.path.abspath(image.filepath, library=image.library)
    for tile in image.tiles:
        row, column = divmod(tile.number - FIRST_UDIM, UDIM_COLUMNS)
        yield Path(path.replace("<UDIM>", str(tile.number)).replace("<UVTILE>", f"u{column + 1}_v{row + 1}"))


def _used_by(shown: Iterable[bpy.types.ID]) -> set[bpy.types.ID]:
    """Return all data-blocks that those `shown` are made of."""
    used: dict[bpy.types.ID, list[bpy.types.ID]] = {}
    for block, users in bpy.data.user_map().items():
        for user in users:
            used.setdefault(user, []).append(block)
    waiting, found = list(shown), set()
    while waiting:
        block = waiting.pop()
        if block not in found:
            found.add(block)
            waiting += used.get(block, ())
    return found


def _of_gltf(path: Path) -> Dependencies:
    """Return the buffers and images that a glTF file names by relative URIs."""
    document = gltf_document(path)
    entries = [entry for kind in ("buffers", "images") for entry in document.get(kind) or ()]
    names = [entry["uri"] for entry in entries if not entry.get("uri", ENCODED).startswith(ENCODED)]
    return _sorted_out(path.parent / unquote(name) for name in names)


def gltf_document(path: Path) -> dict:
    """Return the JSON of a glTF file; raises ValueError where it holds none."""
    content = path.read_bytes()
    if content[:4] == GLB_MAGIC:
        if len(content) < 20 or content[16:20] != GLB_JSON:
            raise ValueError("it has no chunk of JSON")
        (size,) = struct.unpack_from("<I", content, 12)
        content = content[20 : 20 + size]
    try:
        document = json.loads(content)
    except ValueError as error:
        raise ValueError(f"its JSON is damaged ({error})") from error
    if not isinstance(document, dict):
        raise ValueError("its JSON is no object")
    return document


def _of_usd(path: Path) -> Dependencies:
    """Return the layers, images and volumes that a USD file is composed of, in all of its variants."""
    bpy.utils.expose_bundled_modules()
    from pxr import UsdUtils

    layers, assets, lost = UsdUtils.ComputeAllDependencies(str(path))
    files = (_whole(name) for name in (*(layer.realPath for layer in layers), *assets))
    known = {*USD_SUFFIXES, ".abc", ".vdb", *bpy.path.extensions_image}  # not shaders in languages that Blender does not read
    needed = [name for name in lost if _whole(name).suffix.lower() in known]
    spared = [name for name in lost if name not in needed]
    return Dependencies(tuple(dict.fromkeys(file for file in files if file != path)), tuple(needed), tuple(spared))


def _whole(name: str) -> Path:
    """Return the file of a name of OpenUSD's, which may be of a file in a .usdz."""
    from pxr import Ar

    return Path(Ar.SplitPackageRelativePathOuter(name)[0])


def _of_obj(path: Path) -> Dependencies:
    """Return the material libraries of an .obj file; Blender lists their images once it is loaded."""
    names = [line.partition("mtllib")[2].strip().replace('"', "") for line in _lines(path) if line.lstrip().startswith("mtllib")]
    default = path.with_suffix(".mtl")  # which Blender reads as well, and people's files count on it
    given = _sorted_out(path.parent / name for name in names)
    if not default.is_file():
        return given
    return Dependencies(tuple(dict.fromkeys((*given.files, default))), (), given.missing)


def _lines(path: Path) -> Iterator[str]:
    with path.open(encoding="utf-8", errors="surrogateescape") as file:
        yield from file


def _sorted_out(files: Iterable[Path]) -> Dependencies:
    """Return which of these files are there."""
    given = dict.fromkeys(Path(os.path.normpath(file)) for file in files)
    return Dependencies(tuple(file for file in given if file.is_file()), tuple(str(file) for file in given if not file.is_file()))


NAMED: Mapping[str, Callable[[Path], Dependencies]] = {
    ".glb": _of_gltf,
    ".gltf": _of_gltf,
    ".obj": _of_obj,
    **dict.fromkeys(USD_SUFFIXES, _of_usd),
}


def joined(parts: Collection[Dependencies]) -> Dependencies:
    """Return what several lists have together."""
    return Dependencies(
        *(tuple(dict.fromkeys(name for part in parts for name in getattr(part, kind))) for kind in ("files", "missing", "spared"))
    )
