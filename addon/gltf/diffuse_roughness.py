# SPDX-License-Identifier: GPL-3.0-or-later
"""KHR_materials_diffuse_roughness: the roughness of the EON that stands for a model (`diffuse.py`), as a factor and a texture."""

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import bpy

from ..blender import fcurves
from ..material.bake import CannotBake
from ..material.links import Place, source, upstream
from ..material.revert import taken_as_is
from ..material.surface import Loss
from ..material.upgrade import current_name
from ..models.geometry import clamp
from ..nodes.graph import Graph, Value
from .animation import PATHS
from .diffuse import Diffuse
from .inputs import OWN_VALUE, Bake, NotHeld, Product, link_image, product_of
from .stand_in import Replaced

if TYPE_CHECKING:
    from io_scene_gltf2.blender.exp.material.search_node_tree import NodeSocket
    from io_scene_gltf2.io.com.gltf2_io import Material, TextureInfo

NAME = "KHR_materials_diffuse_roughness"
POINTER = f"/materials/XXX/extensions/{NAME}/diffuseRoughnessFactor"
INPUT = "Diffuse Roughness"  # of the Principled BSDF
NEAR = 0.01  # of EON's roughness: 0.5 % of the radiance, as Lambert is 10 % off EON of 0.2
STEPS = 32
SMALL = 32  # pixels each way that an image is scaled to for its mean
CHANNELS = {"Color": 0, "Red": 0, "Green": 1, "Blue": 2, "Alpha": 3}


def arrange(replaced: Replaced, bake: Bake | None) -> Iterator[Loss]:
    """Make an image of the model's roughness one of EON's, after `inputs.arrange`; yields a loss where it is scaled instead.

    A factor suffices where EON's roughness is in proportion to the model's.
    """
    diffuse, place = Diffuse(replaced), _place(replaced)
    if not (diffuse.model.is_rough and place.socket.is_linked):
        return
    found = _held(place)
    if not found.images:
        return
    if diffuse.color_varies:
        mean = _mean(found.images[0])
        replaced.mean_roughness = None if mean is None else found.factor[0] * mean
    off = _off(diffuse, found.factor[0])
    if off <= NEAR:
        return
    why_not = ""
    if bake:
        try:
            with _turned_into_eon(place, diffuse):
                image = bake(place, False)
        except CannotBake as reason:
            why_not = f" and not baked, as {reason}"
        else:
            link_image(place, image)
            replaced.has_eon_roughness = True
            return
    what = f"an image of the roughness of {diffuse.model.label}"
    instead = f"EON's roughness in proportion to it, up to {off:.2g} off, is written{why_not}"
    yield Loss("diffuse_roughness", replaced.label, what, instead)


def write(
    gltf_material: "Material", material: bpy.types.Material, replaced: Replaced, diffuse: Diffuse, settings: dict
) -> Iterator[Loss]:
    """Write the extension, but for a smooth surface; yields what it cannot hold."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import get_factor_from_socket
    from io_scene_gltf2.io.com.gltf2_io_extensions import Extension

    place, factor, texture = _place(replaced), diffuse.roughness, None
    if diffuse.model.is_rough and diffuse.varies and place.socket.is_linked:
        found = _held(place)
        if found.images and settings["gltf_image_format"] != "NONE":
            texture = yield from _texture(place, found.images[0], material, settings)
        if texture:
            factor = found.factor[0] if replaced.has_eon_roughness else _line(diffuse, found.factor[0])
    is_own = diffuse.has_own_roughness and not replaced.has_eon_roughness and not replaced.groups
    is_moving = is_own and not place.socket.is_linked and _is_animated(replaced)
    path = f"node_tree.{place.socket.path_from_id('default_value')}" if is_moving else None
    if is_own and texture:
        _, path = get_factor_from_socket(_gathered(place.socket, place), "VALUE")
    if path:
        settings[PATHS][path] = {"length": 1, "path": POINTER}
    is_smooth = factor <= 0.0 and not (is_moving and settings["gltf_export_anim_pointer"])
    if is_smooth or "KHR_materials_unlit" in gltf_material.extensions:
        return
    written: dict[str, float | TextureInfo] = {"diffuseRoughnessFactor": clamp(factor, 0.0, 1.0)}
    if texture:
        written["diffuseRoughnessTexture"] = texture
    gltf_material.extensions[NAME] = Extension(NAME, written, False)


def _place(replaced: Replaced) -> Place:
    return Place(replaced.principled.inputs[INPUT], replaced.groups)


def _held(place: Place) -> Product:
    """Return what feeds the input as a product; where it is none, the image that is written without the rest."""
    try:
        return product_of(place, False)
    except NotHeld:
        images = [output for output in upstream(place) if output.node.type == "TEX_IMAGE" and output.node.image]
        return Product(images=images[:1])


def _mean(output: Place) -> float | None:
    """Return the mean of an image node's output over the image; None for tiles and for an image that is not there."""
    if output.node.bl_idname == "ShaderNodeSeparateColor":
        channel, output = CHANNELS[output.socket.name], source(output.input(0))
    else:
        channel = CHANNELS[output.socket.name]
    image = output.node.image
    if image.source == "TILED" or not all(image.size):
        return None
    if image.is_dirty:  # of which a copy would not have the pixels
        return _average(image, channel)
    small = image.copy()
    try:
        small.scale(SMALL, SMALL)
        return _average(small, channel)
    finally:
        bpy.data.images.remove(small)


def _average(image: bpy.types.Image, channel: int) -> float:
    values = image.pixels[channel :: image.channels]
    return sum(values) / len(values)


def _line(diffuse: Diffuse, highest: float) -> float:
    """Return the k for which k t is nearest to EON's roughness for the model's `highest` t, t in [0, 1]: by least squares."""
    steps = [step / STEPS for step in range(STEPS + 1)]
    return sum(t * diffuse.eon_roughness(highest * t) for t in steps) / sum(t * t for t in steps)


def _off(diffuse: Diffuse, highest: float) -> float:
    """Return how far off that line is at most."""
    slope = _line(diffuse, highest)
    return max(abs(diffuse.eon_roughness(highest * step / STEPS) - slope * step / STEPS) for step in range(STEPS + 1))


@contextmanager
def _turned_into_eon(place: Place, diffuse: Diffuse) -> Generator[None]:
    """Have a node group before the input that makes EON's roughness of what feeds it."""
    tree, feeding = place.node.id_data, place.socket.links[0].from_socket
    group = bpy.data.node_groups.new("EON Roughness", "ShaderNodeTree")
    node = tree.nodes.new("ShaderNodeGroup")
    try:
        group.interface.new_socket("Roughness", in_out="INPUT", socket_type="NodeSocketFloat")
        group.interface.new_socket("EON", in_out="OUTPUT", socket_type="NodeSocketFloat")
        graph = Graph(group)
        entrance = next(inner for inner in group.nodes if inner.type == "GROUP_INPUT").outputs[0]
        graph.end({"EON": diffuse.eon_roughness(Value(graph, entrance), graph)})
        node.node_tree = group
        tree.links.new(feeding, node.inputs[0])
        tree.links.new(node.outputs[0], place.socket)
        yield
    finally:
        tree.nodes.remove(node)
        bpy.data.node_groups.remove(group)
        tree.links.new(feeding, place.socket)


def _texture(
    place: Place, image: Place, material: bpy.types.Material, settings: dict
) -> Generator[Loss, None, "TextureInfo | None"]:
    """Return the texture as the exporter writes those of other inputs, with its sampler, transform and UV map."""
    from io_scene_gltf2.blender.exp.material.texture_info import gather_texture_info

    with _into_red(place, image) as socket:
        gathered = _gathered(socket, place)
        texture, uv_map, _, _ = gather_texture_info(gathered, (gathered,), settings)
    moved, settings["current_texture_transform"] = settings["current_texture_transform"], {}
    if texture is None:
        yield Loss("diffuse_roughness", image.label, f"the image {image.node.image.name}", OWN_VALUE)
        return None
    for path, entry in moved.items():
        pointer = entry["path"].replace("YYY", f"extensions/{NAME}/diffuseRoughnessTexture/extensions")
        written = settings[PATHS].setdefault(path, {**entry, "path": pointer})
        if written["path"] != pointer:
            written.setdefault("additional", []).append(pointer)
    meshes = [mesh for mesh in bpy.data.meshes if material.original in mesh.materials[:] and mesh.uv_layers]
    indices = [_index(mesh, uv_map.get("value", "")) for mesh in meshes]
    if len(set(indices)) > 1:
        what = "a UV map that is not at the same place on all meshes"
        yield Loss("diffuse_roughness", image.label, what, f"that of {meshes[0].name} is written")
    if uv_map["type"] == "Attribute" and any(uv_map["value"] not in mesh.uv_layers for mesh in meshes):
        what = f"the attribute {uv_map['value']}, which is no UV map,"
        yield Loss("diffuse_roughness", image.label, what, "the UV map that renders is written")
    if indices and indices[0]:
        texture.tex_coord = indices[0]
    return texture


def _gathered(socket: bpy.types.NodeSocket, place: Place) -> "NodeSocket":
    """Return an input of the tree that `place` is in as the exporter has it."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import NodeSocket

    return NodeSocket(socket, [place.node.id_data, *place.groups])


@contextmanager
def _into_red(place: Place, image: Place) -> Generator[bpy.types.NodeSocket]:
    """Yield an input by which the exporter puts the channel of `image` that feeds `place` into the red one."""
    if CHANNELS[image.socket.name] == 0:  # whose red it keeps where it is
        yield place.socket
        return
    tree = place.node.id_data
    node = tree.nodes.new("ShaderNodeBsdfPrincipled")
    try:
        tree.links.new(place.socket.links[0].from_socket, node.inputs["Coat Weight"])  # which glTF has in red, too
        yield node.inputs["Coat Weight"]
    finally:
        tree.nodes.remove(node)


def _index(mesh: bpy.types.Mesh, uv_map: str) -> int:
    """Return the place of a UV map, that of the one which renders where the mesh has none of that name."""
    found = mesh.uv_layers.find(uv_map)
    return found if found >= 0 else next(i for i, layer in enumerate(mesh.uv_layers) if layer.active_render)


def _is_animated(replaced: Replaced) -> bool:
    """Return whether the roughness of the node of ours is keyed or driven."""
    node = replaced.node
    moving = {fcurves.input_of(curve) for curve in fcurves.of_node(node.id_data, node)}
    names = {current_name(node.inputs[index].name) for index in moving if index is not None}
    return taken_as_is(node).get(INPUT) in names
