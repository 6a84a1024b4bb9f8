# SPDX-License-Identifier: GPL-3.0-or-later
"""Bakes what feeds an input of a node to an image, with Cycles' own bake, for targets that cannot hold the nodes.

    image = bake_input(material, Place(node.inputs["Base Color"]), resolution=1024, is_color=True)

The bake takes place in a scene of its own, on copies of the objects that use the material, with a copy of the material in which an
Emission shows the input. So nothing of the file is changed, whatever happens; what was made is removed but for the image.
"""

from collections.abc import Generator, Sequence
from contextlib import ExitStack, contextmanager

import bpy

from ..blender import engines
from .links import Place, upstream

MARGIN = 16  # pixels around the islands of the UV map, at a resolution of 1024
SAMPLES = 16  # of a pixel, spread over it
# Nodes, and outputs of nodes, whose value is another from every side
VIEW_NODES = {"CAMERA", "LAYER_WEIGHT", "FRESNEL", "LIGHT_PATH"}
VIEW_OUTPUTS = {("TEX_COORD", "Camera"), ("TEX_COORD", "Window"), ("TEX_COORD", "Reflection"), ("NEW_GEOMETRY", "Incoming")}


class CannotBake(Exception):
    """An input cannot be baked; the message says why, in a few words."""


def bake_input(
    material: bpy.types.Material,
    place: Place,
    resolution: int,
    *,
    is_color: bool,
    used_as: bpy.types.Material | None = None,
    uv_map: str = "",
) -> bpy.types.Image:
    """Return a new image of what feeds the input `place` of a node of `material`, on the UV map of the meshes that use it.

    The image is square, of `resolution` pixels, with 8 bits a channel: for `is_color` sRGB-encoded, else data as they are; values
    outside 0 to 1 are cut off. An input named Normal or Coat Normal gives a normal map in tangent space, green upwards. The
    objects are those whose slots hold `used_as`, which is `material` itself by default, or the material that it is a copy of; they
    share the image. `uv_map` names the UV map, by default it is the one of each mesh that renders. Raises CannotBake where no mesh
    with a UV map uses the material, where the value depends on the view, or where Cycles fails.
    """
    for output in upstream(place):
        if output.node.type in VIEW_NODES or (output.node.type, output.socket.name) in VIEW_OUTPUTS:
            raise CannotBake(f"{output.label} depends on the view")
    users = _users(used_as or material, uv_map)
    is_normal = place.socket.name in ("Normal", "Coat Normal")
    name = f"{(used_as or material).name} {place.socket.name}".replace(".", " ")  # exporters cut off what they take for an ending
    image = bpy.data.images.new(name, resolution, resolution, alpha=False)
    image.colorspace_settings.is_data = not is_color
    try:
        with ExitStack() as stack:
            shown = stack.enter_context(_showing(material, place, image, is_normal))
            scene = stack.enter_context(baking_scene())
            copies = [stack.enter_context(_copy(item, used_as or material, shown, scene)) for item in users]
            _bake(scene, copies, image, uv_map, is_normal)
    except BaseException as error:
        bpy.data.images.remove(image)
        if isinstance(error, RuntimeError):  # what an operator raises
            raise CannotBake(str(error).strip().removeprefix("Error: ")) from error
        raise
    return image


def _users(material: bpy.types.Material, uv_map: str) -> list[bpy.types.Object]:
    """Return one object for each mesh that `material` is a slot of. Raises CannotBake where none has the UV map."""
    users = [
        item
        for item in bpy.data.objects
        if item.type == "MESH" and any(slot.material and slot.material == material for slot in item.material_slots)
    ]
    if not users:
        raise CannotBake("no mesh uses the material")
    users = [item for item in users if (uv_map in item.data.uv_layers if uv_map else item.data.uv_layers)]
    if not users:
        raise CannotBake(f"no mesh that uses the material has the UV map {uv_map}" if uv_map else "its meshes have no UV map")
    return list({item.data: item for item in reversed(users)}.values())


@contextmanager
def _showing(material: bpy.types.Material, place: Place, image: bpy.types.Image, is_normal: bool) -> Generator[bpy.types.Material]:
    """Yield a copy of `material` that emits what feeds `place`, or for a normal is a Diffuse BSDF with it; `image` is baked to."""
    copy = material.copy()
    made: list[bpy.types.ID] = [copy]
    try:
        trees, nodes = [copy.node_tree], []
        for group in place.groups:
            node = trees[-1].nodes[group.name]
            node.node_tree = node.node_tree.copy()
            made.append(node.node_tree)
            trees.append(node.node_tree)
            nodes.append(node)
        inner = trees[-1].nodes[place.node.name]
        socket = next(socket for socket in inner.inputs if socket.identifier == place.socket.identifier)
        shader = _closure(socket, is_normal)
        for tree, node in zip(reversed(trees[1:]), reversed(nodes), strict=True):
            tree.interface.new_socket("Baked", in_out="OUTPUT", socket_type="NodeSocketShader")
            end = next(end for end in tree.nodes if end.type == "GROUP_OUTPUT" and end.is_active_output)
            tree.links.new(shader, end.inputs["Baked"])
            shader = node.outputs["Baked"]
        for output in [node for node in copy.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]:
            copy.node_tree.nodes.remove(output)
        output = copy.node_tree.nodes.new("ShaderNodeOutputMaterial")
        copy.node_tree.links.new(shader, output.inputs["Surface"])
        bake_to(copy, image)
        yield copy
    finally:
        bpy.data.batch_remove(made)


def _closure(socket: bpy.types.NodeSocket, is_normal: bool) -> bpy.types.NodeSocket:
    """Return the output of a new closure that shows what feeds `socket`."""
    tree = socket.node.id_data
    node = tree.nodes.new("ShaderNodeBsdfDiffuse" if is_normal else "ShaderNodeEmission")
    shown = node.inputs["Normal" if is_normal else "Color"]
    if socket.is_linked:
        tree.links.new(socket.links[0].from_socket, shown)
    elif not is_normal:
        value = socket.default_value
        shown.default_value = (value, value, value, 1.0) if isinstance(value, (float, int)) else (*value[:3], 1.0)
    return node.outputs[0]


def bake_to(material: bpy.types.Material, image: bpy.types.Image) -> None:
    """Have Cycles bake `material` to `image`, by a new image node, the active one."""
    node = material.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    for other in material.node_tree.nodes:
        other.select = other == node
    material.node_tree.nodes.active = node


@contextmanager
def baking_scene() -> Generator[bpy.types.Scene]:
    """Yield a new scene for baking, at the frame of the current one."""
    current = bpy.context.scene
    scene = bpy.data.scenes.new("True Diffuse Bake")
    try:
        engines.choose(scene, engines.CYCLES.identifier)
        scene.cycles.device = "CPU"
        scene.cycles.samples = SAMPLES
        scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
        scene.unit_settings.scale_length = current.unit_settings.scale_length
        scene.frame_set(current.frame_current, subframe=current.frame_subframe)
        yield scene
    finally:
        bpy.data.scenes.remove(scene)


@contextmanager
def _copy(
    item: bpy.types.Object, material: bpy.types.Material, shown: bpy.types.Material, scene: bpy.types.Scene
) -> Generator[bpy.types.Object]:
    """Yield a copy of `item` in `scene` with `shown` in place of `material`; what others bake is discarded."""
    copy = item.copy()
    made: list[bpy.types.ID] = [copy]
    try:
        for slot in copy.material_slots:
            wanted = shown
            if slot.material != material:
                wanted = bpy.data.materials.new("Other")
                image = bpy.data.images.new("Other", 1, 1)
                made += [wanted, image]
                bake_to(wanted, image)
            slot.link = "OBJECT"
            slot.material = wanted
        copy.hide_render = copy.hide_viewport = copy.hide_select = False
        scene.collection.objects.link(copy)
        yield copy
    finally:
        bpy.data.batch_remove(made)


def _bake(scene: bpy.types.Scene, items: Sequence[bpy.types.Object], image: bpy.types.Image, uv_map: str, is_normal: bool) -> None:
    """Bake all objects to one image: with the margin, and where there are several once more without, as margins cover neighbors."""
    margins = [max(1, MARGIN * image.size[0] // 1024)] + [0] * (len(items) > 1)
    first = True
    for margin in margins:
        for item in items:
            bake_object(
                scene,
                item,
                type="NORMAL" if is_normal else "EMIT",
                normal_space="TANGENT",
                margin=margin,
                use_clear=first,
                uv_layer=uv_map or next(layer.name for layer in item.data.uv_layers if layer.active_render),
                target="IMAGE_TEXTURES",
                save_mode="INTERNAL",
            )
            first = False


def bake_object(scene: bpy.types.Scene, item: bpy.types.Object, **options: object) -> None:
    """Bake one object of a scene from `baking_scene`, with Blender's `options`. Raises RuntimeError where Cycles fails."""
    view_layer = scene.view_layers[0]
    view_layer.objects.active = item
    for other in view_layer.objects:
        other.select_set(other == item, view_layer=view_layer)
    with bpy.context.temp_override(scene=scene, view_layer=view_layer, object=item, active_object=item, selected_objects=[item]):
        bpy.ops.object.bake(**options)
