# SPDX-License-Identifier: GPL-3.0-or-later
"""One asset: imported with Blender's own importers, exported by Blender alone, converted, and asked of every target."""

import re
import traceback
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import bpy

from true_diffuse.addon.blender import engines, report
from true_diffuse.addon.material.convert import convert_materials
from true_diffuse.scripts.census import features, gltf_file, usd_file
from true_diffuse.scripts.census.features import MaterialFacts
from true_diffuse.scripts.census.pictures import Difference, Stage
from true_diffuse.scripts.census.table import TARGETS
from true_diffuse.scripts.census.values import PLACES, Place, Value
from true_diffuse.scripts.census.verdict import Verdict, judge, judge_picture, poorer
from true_diffuse.scripts.characters.character import importer_reason

# Channels of glTF alone: occlusion means nothing to Blender otherwise; culling is the mesh's in USD, and the view's in a picture
NOT_JUDGED = {"occlusion", "culling"}
NO_PREVIEW = {"sheen", "transmission", "anisotropy", "thin film", "subsurface"}  # UsdPreviewSurface lacks them
# How far a picture may be from the other: Cycles' of a converted material from its own before, Realtime's from Cycles'
CLOSE = {"cycles": 0.01, "realtime": 0.05}
FRAMES = 3  # of a traceback that are kept
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


def examine(path: Path, folder: Path, size: int, has_realtime: bool) -> dict[str, Any]:
    """Return the record of one asset, for JSON; `folder` is for the files that are written. Raises AssetError.

    Pictures are of `size` pixels a side, none for 0, and without Realtime unless `has_realtime`.
    """
    import true_diffuse

    bpy.utils.expose_bundled_modules()  # before any export, so that all use one copy of pxr
    _open(path)
    missing = _prepare_images()
    subjects = _subjects()
    if not subjects:
        raise AssetError("has no mesh with a material whose nodes make a surface")
    materials = [bpy.data.materials[subject.name] for subject in subjects]
    before, after = Exports(), Exports()
    before.write(folder / "before")
    stage = Stage(size, any("alpha" in subject.facts.channels for subject in subjects)) if size else None
    original = stage.draw(engines.CYCLES) if stage else {}
    indices = {material.name: material.pass_index for material in materials}
    true_diffuse.register()
    bpy.context.preferences.addons.new().module = true_diffuse.__name__  # where Blender's glTF exporter looks for extensions
    report.take()
    said, converted = after.attempt("cycles", lambda: _convert(materials)) or ([], set())
    after.write(folder / "after")
    differences: dict[str, dict[str, Difference]] = {}
    if stage:
        drawn = after.attempt("cycles", lambda: stage.draw(engines.CYCLES))
        if drawn:
            differences["cycles"] = stage.compare(drawn, original, indices)
        if drawn and has_realtime:
            after.lines["realtime"] = after.attempt("realtime", lambda: _realtime_losses(materials)) or []
            shown = after.attempt("realtime", lambda: stage.draw(engines.REALTIME))
            differences["realtime"] = stage.compare(shown, drawn, indices) if shown else {}
    records = [
        _record(subject, _of(said, subject.name), subject.name in converted, before, after, differences) for subject in subjects
    ]
    return {"missing images": missing, "failures": after.failures, "materials": records}


def _convert(materials: Sequence[bpy.types.Material]) -> tuple[list[str], set[str]]:
    """Convert materials; return what was said, and the names of those that were converted."""
    result = convert_materials(materials, bpy.context.scene.unit_settings.scale_length)
    return result.lines, set(result.converted)


def _realtime_losses(materials: Sequence[bpy.types.Material]) -> list[str]:
    """Return what Realtime says that it does not draw."""
    from true_diffuse.addon.realtime.materials import render_material

    return [f"{material.name}: {loss}" for material in materials for loss in getattr(render_material(material, 1.0), "losses", ())]


def _record(
    subject: Subject,
    said: Sequence[str],
    is_converted: bool,
    before: "Exports",
    after: "Exports",
    differences: Mapping[str, Mapping[str, Difference]],
) -> dict[str, Any]:
    channels, same_as, name = subject.facts.channels, subject.facts.same_as, subject.name
    expected = {channel: [value, *same_as.get(channel, ())] for channel, value in channels.items()}
    verdicts: dict[str, dict[str, str]] = {}
    lost: dict[str, list[str]] = {}
    lines = {target: [*said, *_of(given, name)] for target, given in after.lines.items()}
    for target, held in after.held.items():
        mine = held.get(name, {})
        if name not in before.written[target] | after.written[target] and target not in after.failures:
            verdicts[target] = dict.fromkeys(channels, Verdict.NONE)
            continue
        verdicts[target] = {
            channel: judge(channel, values, mine.get(channel), lines[target], subject.uv_maps)
            for channel, values in expected.items()
            if target == "gltf" or channel not in NOT_JUDGED | (NO_PREVIEW if target == "preview" else set())
        }
        lost[target] = poorer(expected, before.held.get(target, {}).get(name, {}), mine, subject.uv_maps)
    for target, found in differences.items():
        asked = [channel for channel in channels if channel not in NOT_JUDGED]
        verdicts[target] = judge_picture(asked, found.get(name), CLOSE[target], lines.get(target, said), target in after.failures)
    for given in verdicts.values():
        given["surface"] = _worst(given)
    return {
        "name": subject.own_name,
        "closures": subject.facts.closures,
        "converted": is_converted,
        "features": [asdict(feature) for feature in subject.facts.features],
        "channels": {channel: _shown(value) for channel, value in channels.items()},
        "verdicts": verdicts,
        "poorer": lost,
        "pictures": {target: asdict(found[name]) for target, found in differences.items() if name in found},
        "held": {target: _shown_all(held.get(name, {}), channels) for target, held in after.held.items()},
        "lines": [*said, *(f"{TARGETS[target]}: {line}" for target, given in after.lines.items() for line in _of(given, name))],
    }


def _worst(verdicts: Mapping[str, str]) -> Verdict:
    order = (Verdict.LOST, Verdict.SAID, Verdict.BAKED, Verdict.KEPT)
    return next((verdict for verdict in order if verdict in verdicts.values()), Verdict.NONE)


def _shown_all(held: Mapping[str, Sequence[Value]], channels: Collection[str]) -> dict[str, list[str]]:
    """Return what a material holds on some channels, in words."""
    return {channel: [_shown(value) for value in values] for channel, values in held.items() if channel in channels}


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
        image.filepath_raw = f"//{image.name}.png"
        for file in image.packed_files:  # by which Blender names what it writes
            file.filepath = image.filepath_raw
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
    """What each target holds of each material, the lines that it said, and what made it fail."""

    held: dict[str, Held] = field(default_factory=dict)
    written: dict[str, set[str]] = field(default_factory=dict)
    """The materials that are in a file, whatever it has of them: not those of what is hidden."""
    lines: dict[str, list[str]] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)

    def attempt[Result](self, target: str, work: Callable[[], Result]) -> Result | None:
        """Return what `work` does; where it raises, that is a target's failure."""
        try:
            return work()
        except Exception as error:  # whatever it is, the other targets go on
            self.failures[target] = "".join(traceback.format_exception(error)[-FRAMES:]).strip()
            return None

    def write(self, folder: Path) -> None:
        """Export the open file to USD and glTF, and read both."""
        folder.mkdir(parents=True, exist_ok=True)
        networks = self.attempt("materialx", lambda: self._usd(folder / "asset.usdc")) or {}
        lines = report.take()
        for target, kind in (("preview", usd_file.PREVIEW), ("materialx", usd_file.MATERIALX)):
            self.held[target] = {name: kinds[kind] for name, kinds in networks.items() if kind in kinds}
            self.written[target] = set(networks)
            self.lines[target] = lines
        self.held["gltf"] = self.attempt("gltf", lambda: self._gltf(folder / "asset.glb")) or {}
        self.written["gltf"] = set(self.held["gltf"])
        self.lines["gltf"] = report.take()

    def _usd(self, path: Path) -> dict[str, dict[str, usd_file.Candidates]]:
        bpy.ops.wm.usd_export(
            filepath=str(path),
            export_animation=False,
            export_armatures=False,
            export_shapekeys=False,
            export_hair=False,
            generate_materialx_network=True,
            evaluation_mode="RENDER",
        )
        return usd_file.read(path)

    def _gltf(self, path: Path) -> dict[str, gltf_file.Candidates]:
        bpy.ops.export_scene.gltf(
            filepath=str(path), export_format="GLB", export_animations=False, export_skins=False, export_morph=False
        )
        return gltf_file.read(path)
