# SPDX-License-Identifier: GPL-3.0-or-later
"""What glTF, as Blender's exporter writes it, can hold of what feeds the inputs of a Principled BSDF.

A color or number can be a constant, an image, and for base color and alpha a color attribute, or their product. The exporter knows
such a product only in the shape of its own importer, and takes the nearest image behind anything else without a word. So `arrange`
links a product in that shape, and says or bakes what is none.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import bpy

from ..blender import color_spaces
from ..material.bake import CannotBake
from ..material.links import Place, source, upstream
from ..material.surface import Loss

# Inputs that the exporter writes, by what it can write of them.
COLORS = {"Base Color", "Emission Color", "Specular Tint", "Sheen Tint"}
NUMBERS = {
    "Metallic",
    "Roughness",
    "Alpha",
    "Specular IOR Level",
    "Transmission Weight",
    "Coat Weight",
    "Coat Roughness",
    "Sheen Roughness",
    "Diffuse Roughness",  # by diffuse_roughness.py
}
NORMALS = {"Normal", "Coat Normal"}
CONSTANTS = {"IOR", "Emission Strength", "Sheen Weight"}
ATTRIBUTES = {"Base Color", "Alpha"}  # the inputs for which it writes color attributes
# Weights and the inputs that count only above 0 of them
LAYERS: Mapping[str, tuple[str, ...]] = {
    "Coat Weight": ("Coat Roughness", "Coat Normal"),
    "Sheen Weight": ("Sheen Roughness", "Sheen Tint"),
    "Emission Strength": ("Emission Color",),
    "Specular IOR Level": ("Specular Tint",),
}
# Inputs of which the exporter makes one texture, with the place of the first
MERGED = (("Base Color", "Alpha"), ("Metallic", "Roughness"), ("Coat Weight", "Coat Roughness"))
COLOR_TYPES = {"FLOAT_COLOR", "BYTE_COLOR"}
OWN_VALUE = "the socket's own value is written"

type Bake = Callable[[Place, bool], bpy.types.Image]
"""Returns an image of what feeds an input, a color or not."""


class NotHeld(Exception):
    """glTF cannot hold a link: `node` is the label of the node, `what` says what is lost."""

    def __init__(self, place: Place, what: str) -> None:
        super().__init__(what)
        self.node, self.what = place.label, what


@dataclass
class Product:
    """A constant times images and color attributes, given by the outputs that they come from."""

    factor: tuple[float, float, float] = (1.0, 1.0, 1.0)
    images: list[Place] = field(default_factory=list)
    attributes: list[Place] = field(default_factory=list)
    is_arranged: bool = True
    """Whether the exporter knows the nodes that multiply."""
    constants: int = 0

    def __mul__(self, other: "Product") -> "Product":
        red, green, blue = (a * b for a, b in zip(self.factor, other.factor, strict=True))
        return Product(
            (red, green, blue),
            self.images + other.images,
            self.attributes + other.attributes,
            self.is_arranged and other.is_arranged,
            self.constants + other.constants,
        )


def is_in_use(principled: bpy.types.Node, name: str) -> bool:
    """Return whether an input counts: one of a layer only where the layer's weight is linked or above 0."""
    weight = next((weight for weight, inputs in LAYERS.items() if name in inputs), None)
    socket = principled.inputs[weight] if weight else None
    return socket is None or socket.is_linked or socket.default_value > 0.0


def varies(place: Place) -> bool:
    """Return whether images or color attributes feed an input."""
    return any(output.node.type in ("TEX_IMAGE", "VERTEX_COLOR", "ATTRIBUTE") for output in upstream(place))


def arrange(principled: Place, meshes: Sequence[bpy.types.Mesh], bake: Bake | None) -> Iterator[Loss]:
    """Link what feeds the inputs of a Principled BSDF as the exporter knows it; yields what glTF cannot hold.

    With `bake`, which returns an image of what feeds an input, a color or not, that is linked instead where it can be.
    """
    for name in sorted(COLORS | NUMBERS | NORMALS | CONSTANTS):
        place = principled.input(name)
        if not place.socket.is_linked or not is_in_use(principled.node, name):
            continue
        try:
            _arrange(place, name)
            _check_attributes(place, meshes)
        except NotHeld as lost:
            why_not = ""
            if bake and name not in CONSTANTS:
                try:
                    baked = _below_clip(place) if name == "Alpha" else place
                    link_image(baked, bake(baked, name in COLORS))
                    continue
                except CannotBake as reason:
                    why_not = f" and not baked, as {reason}"
            yield Loss(name, lost.node, lost.what, _instead(place, name) + why_not)
    rendered = {layer.name for mesh in meshes for layer in mesh.uv_layers if layer.active_render}
    for pair in MERGED:
        if all(principled.input(name).socket.is_linked and is_in_use(principled.node, name) for name in pair):
            yield from _arrange_merged(principled, pair, rendered if len(rendered) == 1 else set(), bake)


def arrange_emission(emissions: Iterable[Place]) -> Iterator[Loss]:
    """Link what feeds Emissions beside a surface as the exporter knows it; yields what glTF cannot hold."""
    for emission in emissions:
        for socket, name in (("Color", "Emission Color"), ("Strength", "Emission Strength")):
            place = emission.input(socket)
            try:
                _arrange(place, name)
            except NotHeld as lost:
                yield Loss(name, lost.node, lost.what, _instead(place, name))


def _arrange_merged(principled: Place, names: tuple[str, str], rendered: set[str], bake: Bake | None) -> Iterator[Loss]:
    """Bake two images of which the exporter makes one texture, or yield a loss, where they are not at the same places."""
    places = [_below_clip(principled.input(name)) for name in names]
    images = [[output for output in upstream(place) if output.node.type == "TEX_IMAGE"] for place in places]
    if not all(images) or _placing(images[0][0], rendered) == _placing(images[1][0], rendered):
        return
    if bake:
        try:
            for place, name in zip(places, names, strict=True):
                link_image(place, bake(place, name in COLORS))
        except CannotBake:
            pass
        else:
            return
    label = images[1][0].label
    yield Loss(names[1], label, f"an image in other places than that of {names[0]}", "the places of that are written")


def _placing(output: Place, rendered: set[str]) -> tuple[object, ...]:
    """Return what says where an image is: its UV map, empty for the one that is `rendered`, its Mapping, extension and filter."""
    node = output.node
    vector = output.input("Vector")
    place = _below_wrap(source(vector), vector)
    mapping: tuple[object, ...] = ()
    if place.socket.is_output and place.node.bl_idname == "ShaderNodeMapping":
        values = (tuple(place.node.inputs[name].default_value) for name in ("Location", "Rotation", "Scale"))
        mapping, place = (place.node.vector_type, *values), source(place.input("Vector"))
    name = getattr(place.node, "uv_map", getattr(place.node, "attribute_name", "")) if place.socket.is_output else ""
    return "" if name in rendered else name, mapping, node.extension, node.interpolation


def _check_attributes(place: Place, meshes: Sequence[bpy.types.Mesh]) -> None:
    """Raise NotHeld where an attribute that feeds an input is no color on one of the meshes: the exporter writes colors alone."""
    for output in upstream(place):
        name = getattr(output.node, "attribute_name", "")
        kinds = {mesh.attributes[name].data_type for mesh in meshes if name in mesh.attributes}
        if (
            output.node.type == "ATTRIBUTE"
            and kinds - COLOR_TYPES
            and "TEX_IMAGE" not in {one.node.type for one in upstream(place)}
        ):
            raise NotHeld(output, f"the attribute {name}, which is no color,")


def is_white(place: Place) -> bool:
    """Return whether a color's input is white."""
    try:
        return product_of(place, True) == Product(constants=1)
    except NotHeld:
        return False


def link_image(place: Place, image: bpy.types.Image) -> None:
    """Link a new image node to an input, through a Normal Map node to one of a normal."""
    tree = place.node.id_data
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = image
    output = node.outputs["Color"]
    if place.socket.name in NORMALS:
        normal_map = tree.nodes.new("ShaderNodeNormalMap")
        tree.links.new(output, normal_map.inputs["Color"])
        output = normal_map.outputs["Normal"]
    tree.links.new(output, place.socket)


def _instead(place: Place, name: str) -> str:
    """Return what is written instead of a link that glTF cannot hold: an image behind it, or the input's own value."""
    from io_scene_gltf2.blender.exp.material.search_node_tree import FilterByType, NodeSocket, from_socket

    wanted = bpy.types.ShaderNodeTexImage
    tree, group_path = place.node.id_data, list(place.groups)
    if name in NORMALS:  # the image of a height or of another space is no normal map
        maps = [output for output in upstream(place) if output.node.type == "NORMAL_MAP" and output.node.space == "TANGENT"]
        if not maps or maps[0].groups != place.groups:
            tree.links.remove(place.socket.links[0])
            return "the normal of the mesh is written"
        tree.links.new(maps[0].socket, place.socket)
    if name not in CONSTANTS:
        found = from_socket(NodeSocket(place.socket, [tree, *group_path]), FilterByType(wanted))
        if found and found[0].shader_node.image:
            return f"the image {found[0].shader_node.image.name} is written without it"
    tree.links.remove(place.socket.links[0])
    return OWN_VALUE


def _arrange(place: Place, name: str) -> None:
    if name in NORMALS:
        _check_normal(place)
        return
    if name == "Alpha":
        place = _below_clip(place)
    is_color = name in COLORS
    product = product_of(place, is_color)
    if name in CONSTANTS and product.images:
        raise NotHeld(product.images[0], "an image")
    if product.attributes and name not in ATTRIBUTES:
        raise NotHeld(product.attributes[0], "a color attribute")
    for images, what in ((product.images, "a product of images"), (product.attributes, "a product of color attributes")):
        if len(images) > 1:
            raise NotHeld(images[1], what)
    for attribute in product.attributes:
        if (attribute.socket.name == "Alpha") == is_color:
            raise NotHeld(attribute, f"the output {attribute.socket.name} of a color attribute")
    for image in product.images:
        _check_image(image, is_color)
    varies_not = not product.images and not product.attributes
    if not is_color and not varies_not and len(set(product.factor)) > 1:
        raise NotHeld(source(place), "a factor of several colors")
    if not product.is_arranged or product.constants > 1 or (name == "IOR" and varies_not):  # whose links the exporter ignores
        _link(place, product)


def product_of(place: Place, is_color: bool) -> Product:
    """Return what feeds an input, of a color or a number, as a product. Raises NotHeld where it is none."""
    origin = source(place)
    socket, node = origin.socket, origin.node
    if not socket.is_output:
        return Product(_triple(socket.default_value), constants=1)
    if node.mute:
        raise NotHeld(origin, f"the muted node {node.bl_label}")
    is_number = socket.type in ("VALUE", "INT", "BOOLEAN")
    match node.bl_idname:
        case "ShaderNodeValue" | "ShaderNodeRGB":
            return Product(_triple(socket.default_value), constants=1)
        case "ShaderNodeTexImage" if not (is_color and is_number):
            return Product(images=[origin])
        case "ShaderNodeVertexColor":
            return Product(attributes=[origin])
        case "ShaderNodeAttribute" if node.attribute_type == "GEOMETRY" and socket.name in ("Color", "Vector", "Alpha"):
            return Product(attributes=[origin])
        case "ShaderNodeSeparateColor" if node.mode == "RGB" and not is_color:
            inner = product_of(origin.input(0), True)
            if inner.images and not inner.attributes and not inner.constants:
                return Product(images=[origin])
        case "ShaderNodeMix" if node.data_type == "RGBA" and node.blend_type == "MULTIPLY" and not node.clamp_result:
            return _mixed(origin, is_color)
        case "ShaderNodeMath" if node.operation == "MULTIPLY" and not node.use_clamp:
            found = product_of(origin.input(0), False) * product_of(origin.input(1), False)
            if not is_color or not (found.images or found.attributes):  # else a gray is made of colors
                return found * Product(is_arranged=not is_color)
        case "ShaderNodeMath" if node.operation == "DIVIDE" and not node.use_clamp and not is_color:
            divisor = product_of(origin.input(1), False)
            if not divisor.images and not divisor.attributes and divisor.factor[0]:
                inverse = 1.0 / divisor.factor[0]
                return product_of(origin.input(0), False) * Product((inverse, inverse, inverse), is_arranged=False)
        case "ShaderNodeVectorMath" if node.operation in ("MULTIPLY", "SCALE"):
            second = product_of(origin.input("Scale" if node.operation == "SCALE" else 1), node.operation == "MULTIPLY")
            return product_of(origin.input(0), True) * second * Product(is_arranged=False)
    raise NotHeld(origin, f"the node {node.bl_label}")


def _mixed(mix: Place, is_color: bool) -> Product:
    """Return the product of a Mix node that multiplies colors, by a constant factor below 1 with a constant color."""
    factor, first, second = (Place(mix.node.inputs[index], mix.groups) for index in (0, 6, 7))
    weight = product_of(factor, False)
    a, b = product_of(first, True), product_of(second, True)
    if weight.images or weight.attributes:
        raise NotHeld(mix, "a mix by a factor that varies")
    part = min(max(weight.factor[0], 0.0), 1.0) if mix.node.clamp_factor else weight.factor[0]
    if part == 1.0:
        return a * b * Product(is_arranged=is_color and not source(factor).socket.is_output)
    if b.images or b.attributes:
        raise NotHeld(mix, "a product of images or color attributes in part")
    red, green, blue = (1.0 - part + part * channel for channel in b.factor)
    return a * Product((red, green, blue), is_arranged=False)


def _triple(value: float | bpy.types.bpy_prop_array) -> tuple[float, float, float]:
    if isinstance(value, (float, int)):
        return float(value), float(value), float(value)
    red, green, blue = value[:3]
    return red, green, blue


def _link(place: Place, product: Product) -> None:
    """Link `product` to an input in the shape that the exporter knows: an image times a constant, times a color attribute."""
    socket, tree = place.socket, place.node.id_data
    sources = product.images + product.attributes
    for output in sources:
        if output.groups != place.groups:
            raise NotHeld(output, "an image or color attribute inside a node group, which is multiplied,")
    for link in list(socket.links):
        tree.links.remove(link)
    is_color = socket.type == "RGBA"
    if not sources:
        socket.default_value = (*product.factor, 1.0) if is_color else product.factor[0]
        return
    factors = [*([product.factor] if product.factor != (1.0, 1.0, 1.0) else []), *(output.socket for output in sources[1:])]
    result = sources[0].socket
    for factor in factors:
        result = _times(tree, result, factor, is_color)
    tree.links.new(result, socket)


def _times(
    tree: bpy.types.ShaderNodeTree,
    output: bpy.types.NodeSocket,
    factor: bpy.types.NodeSocket | tuple[float, float, float],
    is_color: bool,
) -> bpy.types.NodeSocket:
    """Return the output of a new node that multiplies `output` by `factor`."""
    node = tree.nodes.new("ShaderNodeMix" if is_color else "ShaderNodeMath")
    if is_color:
        node.data_type, node.blend_type, node.inputs[0].default_value = "RGBA", "MULTIPLY", 1.0
        first, second, result = node.inputs[6], node.inputs[7], node.outputs[2]
    else:
        node.operation = "MULTIPLY"
        first, second, result = node.inputs[0], node.inputs[1], node.outputs[0]
    tree.links.new(output, first)
    if isinstance(factor, bpy.types.NodeSocket):
        tree.links.new(factor, second)
    else:
        second.default_value = (*factor, 1.0) if is_color else factor[0]
    return result


def constant(place: Place) -> float | None:
    """Return the value of an input where the exporter reads one: its own, or that of a Value node."""
    origin = source(place)
    return origin.socket.default_value if not origin.socket.is_output or origin.node.type == "VALUE" else None


def _below_clip(place: Place) -> Place:
    """Return the input below a cutoff of the alpha, in the shapes that the exporter knows; `place` where there is none."""
    node = source(place)
    if not node.socket.is_output or node.node.type != "MATH":
        return place
    if node.node.operation == "ROUND":
        return node.input(0)
    if node.node.operation == "SUBTRACT" and constant(node.input(0)) == 1.0:
        inner = source(node.input(1))
        is_below = inner.socket.is_output and inner.node.type == "MATH"
        return (is_below and _compared(inner, "LESS_THAN", "GREATER_THAN")) or place
    return _compared(node, "GREATER_THAN", "LESS_THAN") or place


def _compared(node: Place, operation: str, reverse: str) -> Place | None:
    """Return what a node compares to a constant: the first input by `operation`, or the second by its `reverse`."""
    for wanted, own, other in ((operation, 0, 1), (reverse, 1, 0)):
        if node.node.operation == wanted and constant(node.input(other)) is not None and constant(node.input(own)) is None:
            return node.input(own)
    return None


def _check_normal(place: Place) -> None:
    """Raise NotHeld where a normal is anything but an image's, in tangent space."""
    node = source(place)
    if node.node.bl_idname != "ShaderNodeNormalMap" or not node.socket.is_output:
        raise NotHeld(node, f"the node {node.node.bl_label}")
    if node.node.space != "TANGENT":
        raise NotHeld(node, "a normal map in another than tangent space")
    if node.node.convention != "OPENGL":
        raise NotHeld(node, "DirectX's direction of green")
    if node.input("Strength").socket.is_linked:
        raise NotHeld(node, "a linked strength")
    product = product_of(node.input("Color"), True)
    if len(product.images) != 1 or product.attributes or product.constants:
        raise NotHeld(node, "a normal map that is not an image alone")
    _check_image(product.images[0], is_color=False)


def _check_image(output: Place, is_color: bool) -> None:
    """Raise NotHeld where glTF cannot hold an image, or one of its channels, for a color or for data."""
    if output.node.bl_idname == "ShaderNodeSeparateColor":
        output = source(output.input(0))
    node, image = output.node, output.node.image
    if image is None:
        raise NotHeld(output, "an image node without an image")
    if image.source in ("SEQUENCE", "MOVIE"):
        raise NotHeld(output, f"the {image.source.lower()} {image.name}")
    if node.projection != "FLAT":
        raise NotHeld(output, f"{node.projection.capitalize()} projection of the image {image.name}")
    if node.extension == "CLIP":
        raise NotHeld(output, f"the clipped edge of the image {image.name}")
    space = image.colorspace_settings
    if output.socket.name == "Color" and color_spaces.is_data(image) == is_color:
        what = "an image of numbers, but glTF reads it as sRGB" if is_color else "in a color space, but glTF reads it as numbers"
        raise NotHeld(output, f"the image {image.name}, which is {what},")
    # the exporter turns colors of floating-point images into sRGB, and writes others as they are
    if is_color and not image.is_float and not color_spaces.is_srgb(image):
        raise NotHeld(output, f"the color space {space.name} of the image {image.name}")
    _check_coordinates(output.input("Vector"))


def _check_coordinates(place: Place) -> None:
    """Raise NotHeld where coordinates are anything but a UV map, moved, turned and scaled in its plane at most once."""
    node = _below_wrap(source(place), place)
    if not node.socket.is_output:
        return
    if node.node.bl_idname == "ShaderNodeMapping":
        _check_mapping(node)
        node = source(node.input("Vector"))
    match node.node.bl_idname, node.socket.name:
        case ("ShaderNodeUVMap", _) | ("ShaderNodeTexCoord", "UV"):
            return
        case "ShaderNodeAttribute", _ if node.node.attribute_type == "GEOMETRY":
            return
    if node.socket.is_output:
        raise NotHeld(node, f"an image mapped by the output {node.socket.name} of the node {node.node.bl_label}")


def _below_wrap(node: Place, place: Place) -> Place:
    """Return what lies below the nodes that make the two directions wrap in different ways, where the exporter knows them."""
    from io_scene_gltf2.blender.exp.sampler import detect_manual_uv_wrapping

    if node.node.bl_idname == "ShaderNodeCombineXYZ" and detect_manual_uv_wrapping(place.node, [place.node.id_data, *place.groups]):
        split = source(node.input("X"))
        split = split if split.node.bl_idname == "ShaderNodeSeparateXYZ" else source(split.input(0))
        return source(split.input(0))
    return node


def _check_mapping(node: Place) -> None:
    values = {}
    for name in ("Location", "Rotation", "Scale"):
        socket = node.node.inputs[name]
        if socket.enabled and socket.is_linked:
            raise NotHeld(node, f"a linked {name}")
        values[name] = tuple(socket.default_value)
    turn, scale = values["Rotation"], values["Scale"]
    if node.node.vector_type == "NORMAL":
        raise NotHeld(node, "a Mapping node of type Normal")
    if turn[0] or turn[1]:
        raise NotHeld(node, "a rotation out of the UV map's plane")
    quarter = math.isclose(math.sin(2.0 * turn[2]), 0.0, abs_tol=1e-6)
    if node.node.vector_type == "TEXTURE" and scale[0] != scale[1] and not quarter:
        raise NotHeld(node, "a scale along turned axes")
