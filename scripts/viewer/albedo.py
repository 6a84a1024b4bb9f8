# SPDX-License-Identifier: GPL-3.0-or-later
"""What the viewer shows of a character as it is: its base colors, and where it is opaque, baked by Cycles whatever feeds them.

A material gets an image on the UV maps of its meshes. A mesh without one, or whose map leaves the image, has colors at its corners.
"""

import tempfile
from array import array
from base64 import b64encode
from collections import Counter
from collections.abc import Generator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import bpy

from true_diffuse.addon.material import bake
from true_diffuse.addon.material.closure_nodes import TreeGraph, closures, remove_copy, trees
from true_diffuse.addon.measure import probes
from true_diffuse.addon.nodes.graph import Number, Value
from true_diffuse.scenes.five_characters import Character, FiveCharacters
from true_diffuse.scripts.viewer.geometry import Piece

RESOLUTION = 1024  # of an image, which Cycles bakes with a margin
SAMPLES = 4  # of a pixel, spread over it
QUALITY = 90  # of WebP, percent
MARGIN = 16  # pixels around the islands of a map
OUTSIDE = 0.01  # of its map that may leave the image
TRANSMISSION = "Transmission Weight"
BAKED = "Baked"  # a color attribute
NOTE = "shows base color and opacity alone, on the mesh's own normals: no metal, glass, light, normal maps and layers above"
type Source = bpy.types.Material | None  # None is an empty slot


@dataclass
class Baked:
    """What is drawn of a character: `pieces` with `images`, as data: URLs, and a line on each thing that is `lost`."""

    pieces: list[Piece] = field(default_factory=list)
    images: list[str] = field(default_factory=list)
    lost: list[str] = field(default_factory=lambda: [NOTE])


def baked(stage: FiveCharacters) -> Baked:
    """Return what is drawn of the characters of a stage as they are. Raises RuntimeError where Cycles cannot bake."""
    assert stage.converted
    result, character = Baked(), stage.characters[0]
    flat = [part for part in character.parts if _is_mapped(part.data)]
    plain = [part for part in character.parts if part not in flat]
    sources = list(dict.fromkeys(source for part in flat for source in part.data.materials))
    with bake.baking_scene() as scene:
        scene.cycles.samples = SAMPLES
        for part in character.parts:
            scene.collection.objects.link(part)
        scene.view_layers[0].update()
        pixels = _baked_images(scene, character, flat, sources, stage.converted)
        result.images = [_url(pixels[source]) for source in sources]
        colors = _baked_corners(scene, character, plain, stage.converted)
    for part in flat:
        uv = array("f", bytes(8 * len(part.data.loops)))
        _render_map(part.data).uv.foreach_get("vector", uv)
        for slot, source in enumerate(part.data.materials):
            result.pieces.append(Piece(part.data, part.matrix_parent_inverse, slot, uv=uv, image=sources.index(source)))
    for part in plain:
        if part.data.uv_layers:
            result.lost.append(f"{part.name} has images that repeat: their colors at the corners of its faces are shown")
        for slot in range(len(part.data.materials)):
            result.pieces.append(Piece(part.data, part.matrix_parent_inverse, slot, colors=colors[part]))
    return result


def _render_map(mesh: bpy.types.Mesh) -> bpy.types.MeshUVLoopLayer:
    return next(layer for layer in mesh.uv_layers if layer.active_render)


def _is_mapped(mesh: bpy.types.Mesh) -> bool:
    """Return whether a mesh has a UV map within the image."""
    if not mesh.uv_layers:
        return False
    uv = array("f", bytes(8 * len(mesh.loops)))
    _render_map(mesh).uv.foreach_get("vector", uv)
    return all(-OUTSIDE <= value <= 1.0 + OUTSIDE for value in uv)


@contextmanager
def _emitting(
    character: Character, name: str, channel: probes.Channel, converted: Mapping[Source, bpy.types.Material]
) -> Generator[Mapping[Source, bpy.types.Material]]:
    """Yield the materials that the character wears within the body, which emit a channel of the `converted` ones."""
    assert character.materials
    made = {source: probes.emitting(material, name, channel) for source, material in converted.items()}
    character.wear(made)
    try:
        yield made
    finally:
        character.wear(character.materials.shown)
        for material in made.values():
            remove_copy(material)


def _baked_images(
    scene: bpy.types.Scene,
    character: Character,
    parts: Sequence[bpy.types.Object],
    sources: Sequence[Source],
    converted: Mapping[Source, bpy.types.Material],
) -> dict[Source, bpy.types.Image]:
    """Return an image of each source's color, with opacity where it is not known to be 1 everywhere."""
    colors = _baked_channel(scene, character, parts, sources, converted, "color", _color)
    unclear = [source for source in sources if not _is_opaque(converted[source])]
    seen = _baked_channel(scene, character, parts, unclear, converted, "opacity", _opacity) if unclear else {}
    for source, mask in seen.items():
        rgba, opacity = _pixels(colors[source]), _pixels(mask)
        for k in range(0, len(rgba), 4):
            rgba[k + 3] = fraction = opacity[k]
            for channel in range(k, k + 3):
                rgba[channel] = min(1.0, rgba[channel] / fraction) if fraction > 0.0 else 0.0
        colors[source].pixels.foreach_set(rgba)
        bpy.data.images.remove(mask)
    return colors


def _baked_channel(
    scene: bpy.types.Scene,
    character: Character,
    parts: Sequence[bpy.types.Object],
    sources: Sequence[Source],
    converted: Mapping[Source, bpy.types.Material],
    name: str,
    channel: probes.Channel,
) -> dict[Source, bpy.types.Image]:
    """Return an image of a channel of each source's material."""
    images = {source: bpy.data.images.new(name, RESOLUTION, RESOLUTION, alpha=True) for source in sources}
    aside = bpy.data.images.new("Other", 1, 1)  # for what is not asked for
    try:
        with _emitting(character, name, channel, converted) as made:
            for source, material in made.items():
                bake.bake_to(material, images.get(source, aside))
            users = Counter(source for part in parts for source in set(part.data.materials))
            # margins cover what lies beside them, so that parts which share an image are baked once more without
            for margin in (MARGIN, 0) if max(users.values(), default=0) > 1 else (MARGIN,):
                for part in parts:
                    bake.bake_object(scene, part, type="EMIT", margin=margin, use_clear=False, target="IMAGE_TEXTURES")
    finally:
        bpy.data.images.remove(aside)
    return images


def _baked_corners(
    scene: bpy.types.Scene,
    character: Character,
    parts: Sequence[bpy.types.Object],
    converted: Mapping[Source, bpy.types.Material],
) -> dict[bpy.types.Object, list[float]]:
    """Return the color, linear RGB, of each corner of the parts."""
    result = {}
    with _emitting(character, "color", _color, converted):
        for part in parts:
            mesh = part.data
            attribute = mesh.color_attributes.new(BAKED, "FLOAT_COLOR", "CORNER")
            mesh.color_attributes.active_color = attribute
            bake.bake_object(scene, part, type="EMIT", target="VERTEX_COLORS")
            rgba = array("f", bytes(16 * len(mesh.loops)))
            attribute = mesh.color_attributes[attribute.name]
            attribute.data.foreach_get("color", rgba)
            mesh.color_attributes.remove(attribute)
            result[part] = [min(1.0, max(0.0, value)) for k in range(0, len(rgba), 4) for value in rgba[k : k + 3]]
    return result


def _opacity_of(graph: TreeGraph, node: bpy.types.Node) -> Number:
    """Return how much of what is behind it the node of a closure hides: light that it transmits does not count."""
    base = probes.base_of(node)
    if base is None:
        return 0.0
    opacity = graph.number(node.inputs[base.opacity]) if base.opacity else 1.0
    return graph.less(opacity, graph.number(node.inputs[TRANSMISSION])) if TRANSMISSION in base.instead else opacity


def _opacity(graph: TreeGraph, node: bpy.types.Node, _material: bpy.types.Material) -> Value:
    return graph.scale(graph.vector(1.0, 1.0, 1.0), _opacity_of(graph, node))


def _color(graph: TreeGraph, node: bpy.types.Node, _material: bpy.types.Material) -> Value:
    """Return the base color, of metal too, times the opacity."""
    base = probes.base_of(node)
    if base is None:
        return graph.vector(0.0, 0.0, 0.0)
    return graph.scale(graph.clamp(graph.color(node.inputs[base.color]), 0.0, 1.0), _opacity_of(graph, node))


def _is_opaque(material: bpy.types.Material) -> bool:
    """Return whether a material is known to be opaque everywhere."""
    return all(_opacity_of(TreeGraph(tree), node) == 1.0 for tree in trees(material) for node in closures(tree))


def _pixels(image: bpy.types.Image) -> array[float]:
    rgba = array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(rgba)
    return rgba


def _url(image: bpy.types.Image) -> str:
    """Return an image as a data: URL, and remove it."""
    with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
        path = Path(folder) / "image.webp"
        image.file_format = "WEBP"
        image.save(filepath=str(path), quality=QUALITY)
        content = path.read_bytes()
    bpy.data.images.remove(image)
    return f"data:image/webp;base64,{b64encode(content).decode()}"
