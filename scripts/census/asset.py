# SPDX-License-Identifier: GPL-3.0-or-later
"""One asset: imported with Blender's own importers, exported by Blender alone, converted, and asked of every target."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import bpy

from true_diffuse.addon.blender import report
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.scripts.census import features, gltf_file, usd_file
from true_diffuse.scripts.census.features import MaterialFacts
from true_diffuse.scripts.census.table import TARGETS
from true_diffuse.scripts.census.values import PLACES, Place, Value
from true_diffuse.scripts.census.verdict import Verdict, judge, poorer
from true_diffuse.scripts.characters.character import importer_reason

# Channels that are not the target's: occlusion means nothing to Blender, which has it for glTF alone; USD's culling is the mesh's
NOT_JUDGED = {"realtime": {"occlusion", "culling"}, "materialx": {"occlusion", "culling"}, "preview": {"occlusion", "culling"}}
REPLACEMENT_SIZE = 8  # pixels, of the image in place of one whose file is missing
NEUTRAL = (0.5, 0.5, 0.5, 1.0)

type Held = dict[str, dict[str, list[Value]]]  # by material and channel


class AssetError(Exception):
    """The asset cannot be read; the message is one line."""


@dataclass
class Subject:
    """A material of the asset: the name it has here, its own, what it has, and the UV maps of a mesh that uses it."""

    name: str
    own_name: str
    facts: MaterialFacts
    uv_maps: list[str] = field(default_factory=list)
    """The active one, then all in their order."""


def examine(path: Path, folder: Path) -> dict[str, Any]:
    """Return the record of one asset, for JSON; `folder` is for the files that are written. Raises AssetError."""
    import true_diffuse

    bpy.utils.expose_bundled_modules()  # before any export, so that all use one copy of pxr
    _open(path)
    missing = _prepare_images()
    subjects = _subjects()
    if not subjects:
        raise AssetError("has no mesh with a material whose nodes make a surface")
    materials = {subject.name: subject for subject in subjects}
    before = _exports(folder / "before")
    true_diffuse.register()
    bpy.context.preferences.addons.new().module = true_diffuse.__name__  # where Blender's glTF exporter looks for extensions
    report.take()
    converted = convert_materials([bpy.data.materials[name] for name in materials], bpy.context.scene.unit_settings.scale_length)
    realtime, realtime_lines = _realtime(materials)
    after = _exports(folder / "after")
    after.held["realtime"], after.lines["realtime"] = realtime, realtime_lines
    records = [_record(subject, converted.lines, subject.name in converted.converted, before, after) for subject in subjects]
    return {"missing images": missing, "materials": records}


def _record(subject: Subject, lines: Sequence[str], is_converted: bool, before: "Exports", after: "Exports") -> dict[str, Any]:
    said = _of(lines, subject.name)
    channels = subject.facts.channels
    same_as = subject.facts.same_as
    expected = {name: [value, *same_as.get(name, ())] for name, value in channels.items()}
    verdicts: dict[str, dict[str, str]] = {}
    lost: dict[str, list[str]] = {}
    for target, held in after.held.items():
        target_lines = [*said, *_of(after.lines[target], subject.name)]
        mine = held.get(subject.name, {})
        verdicts[target] = {
            channel: judge(channel, values, mine.get(channel), target_lines, subject.uv_maps)
            for channel, values in expected.items()
            if channel not in NOT_JUDGED.get(target, ())
        }
        verdicts[target]["surface"] = _worst(verdicts[target])
        lost[target] = poorer(expected, before.held.get(target, {}).get(subject.name, {}), mine, subject.uv_maps)
    return {
        "name": subject.own_name,
        "closures": subject.facts.closures,
        "converted": is_converted,
        "features": [asdict(feature) for feature in subject.facts.features],
        "channels": {channel: _shown(value) for channel, value in channels.items()},
        "verdicts": verdicts,
        "poorer": lost,
        "held": {
            target: {
                channel: [_shown(value) for value in values]
                for channel, values in held.get(subject.name, {}).items()
                if channel in channels
            }
            for target, held in after.held.items()
        },
        "lines": [
            *said,
            *(f"{TARGETS[target]}: {line}" for target, given in after.lines.items() for line in _of(given, subject.name)),
        ],
    }


def _worst(verdicts: Mapping[str, str]) -> Verdict:
    order = (Verdict.LOST, Verdict.SAID, Verdict.BAKED, Verdict.KEPT)
    return next((verdict for verdict in order if verdict in verdicts.values()), Verdict.NONE)


def _shown(value: Value) -> str:
    """Return a value in words."""
    parts = [
        f"{use.image}.{use.channel}{f' by {use.uv_map}' if use.uv_map else ''}{_moved(use.places)}"
        for use in sorted(value.images, key=repr)
    ]
    parts += [f"attribute {name!r}" for name in sorted(value.attributes)]
    parts += [f"<{name}>" for name in sorted(value.operations)]
    if value.is_constant or value.factor != (1.0, 1.0, 1.0):
        factor = value.factor[:1] if len(set(value.factor)) == 1 else value.factor
        parts.append("/".join(f"{number:.3g}" for number in factor))
    return " x ".join(parts)


def _moved(places: Sequence[Place] | None) -> str:
    if places == PLACES:
        return ""
    return f" at {[tuple(round(c, 3) for c in place) for place in places]}" if places else " elsewhere"


def _of(lines: Sequence[str], name: str) -> list[str]:
    """Return the lines that are about a material, without its name."""
    found = (re.match(rf"(?:True Diffuse: )?{re.escape(name)}\b[: ]*(.*)", line, re.DOTALL) for line in lines)
    return [match[1] for match in found if match]


def _open(path: Path) -> None:
    """Replace the open file by what an asset holds; scripts in it do not run. Raises AssetError."""
    kinds: dict[str, Callable[[], object]] = {
        ".blend": lambda: bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False, use_scripts=False),
        ".glb": lambda: bpy.ops.import_scene.gltf(filepath=str(path)),
        ".gltf": lambda: bpy.ops.import_scene.gltf(filepath=str(path)),
    }
    bpy.ops.wm.read_factory_settings(use_empty=True)
    try:
        kinds.get(path.suffix.lower(), lambda: bpy.ops.wm.usd_import(filepath=str(path)))()
    except (OSError, RuntimeError) as error:
        raise AssetError(f"Blender cannot read it: {importer_reason(error)}") from error


def _prepare_images() -> int:
    """Give every image a name that exporters keep, and pixels where its file is missing; return how many these are."""
    missing = 0
    for index, image in enumerate([image for image in bpy.data.images if image.source in ("FILE", "GENERATED")]):
        if image.library is not None:
            continue
        if not image.size[0]:
            missing += 1
            image.source, image.generated_width, image.generated_height = "GENERATED", REPLACEMENT_SIZE, REPLACEMENT_SIZE
            image.generated_color = NEUTRAL
        if not image.packed_file:
            image.pack()
        image.name = f"image{index:04d}"
        image.filepath_raw = f"//image{index:04d}.png"
    return missing


def _subjects() -> list[Subject]:
    """Return the materials that meshes of the scene use, under names that every format keeps."""
    uv_maps: dict[bpy.types.Material, list[str]] = {}
    for item in bpy.context.scene.objects:
        if item.type != "MESH" or not item.data.polygons:
            continue
        layers = item.data.uv_layers
        active = next((layer.name for layer in layers if layer.active_render), "")
        used = {face.material_index for face in item.data.polygons}
        for index, slot in enumerate(item.material_slots):
            if slot.material and index in used:
                uv_maps.setdefault(slot.material, [active, *(layer.name for layer in layers)] if layers else [])
    subjects = []
    for index, (material, names) in enumerate(uv_maps.items()):
        facts = features.read(material)
        if facts is not None:
            own = material.name
            if material.library is None:
                material.name = f"m{index:03d}"
            subjects.append(Subject(material.name, own, facts, names))
    return subjects


@dataclass
class Exports:
    """What each target holds of each material, and the lines that it said."""

    held: dict[str, Held] = field(default_factory=dict)
    lines: dict[str, list[str]] = field(default_factory=dict)


def _exports(folder: Path) -> Exports:
    """Export the open file to USD and glTF, and read both."""
    folder.mkdir(parents=True, exist_ok=True)
    exports = Exports()
    usd, glb = folder / "asset.usdc", folder / "asset.glb"
    bpy.ops.wm.usd_export(
        filepath=str(usd),
        export_animation=False,
        export_armatures=False,
        export_shapekeys=False,
        export_hair=False,
        generate_materialx_network=True,
        evaluation_mode="RENDER",
    )
    lines = report.take()
    networks = usd_file.read(usd)
    for target, kind in (("preview", usd_file.PREVIEW), ("materialx", usd_file.MATERIALX)):
        exports.held[target] = {name: kinds[kind] for name, kinds in networks.items() if kind in kinds}
        exports.lines[target] = lines
    bpy.ops.export_scene.gltf(
        filepath=str(glb), export_format="GLB", export_animations=False, export_skins=False, export_morph=False
    )
    exports.lines["gltf"] = report.take()
    exports.held["gltf"] = gltf_file.read(glb)
    return exports


def _realtime(names: Mapping[str, Subject]) -> tuple[Held, list[str]]:
    """Return what Realtime draws of each material, as far as its own description says, and what it says it does not."""
    from true_diffuse.scripts.census import realtime

    return realtime.read({name: bpy.data.materials[name] for name in names})
