# SPDX-License-Identifier: GPL-3.0-or-later
"""The seven characters that are glTF files, each for one kind of material that people's characters have. No bpy."""

import math
from collections.abc import Callable, Mapping, Sequence

from true_diffuse.scripts.characters.small.figure import Vector, colors, figure
from true_diffuse.scripts.characters.small.gltf import Json, Primitive, glb
from true_diffuse.scripts.characters.small.picture import png

type Pixel = Callable[[float, float], Sequence[float]]


def material(name: str, *, base: Mapping[str, Json], **others: Json) -> dict[str, Json]:
    """Return a material in glTF's JSON; `base` is its pbrMetallicRoughness."""
    return {"name": name, "pbrMetallicRoughness": dict(base), **others}


def texture(image: str, **others: Json) -> dict[str, Json]:
    """Return the use of a texture in glTF's JSON."""
    return {"index": image, **others}


def wave(u: float, v: float, across: int, down: int) -> float:
    """Return a pattern of 0 to 1 that repeats at the borders."""
    return 0.5 + 0.5 * math.sin(2.0 * math.pi * across * u + 0.7) * math.sin(2.0 * math.pi * down * v + 0.4)


def cloth(first: Vector, second: Vector, across: int = 4, down: int = 4) -> Pixel:
    """Return the pixels of checks of two colors, darker towards the lower right, so that no two corners are alike."""

    def pixel(u: float, v: float) -> Vector:
        color = first if (int(across * u) + int(down * v)) % 2 else second
        shade = 1.0 - 0.3 * u - 0.2 * v
        return tuple(shade * value for value in color)

    return pixel


RED, OCHER, GREEN, BLUE = (0.75, 0.25, 0.2), (0.85, 0.7, 0.4), (0.3, 0.55, 0.3), (0.25, 0.35, 0.7)
SKIN, GRAY, WHITE = (0.85, 0.62, 0.5), (0.5, 0.5, 0.5), (0.95, 0.95, 0.95)


def packed_orm() -> bytes:
    """Occlusion, roughness and metallic in one image whose metallic is 0 everywhere; one without occlusion, times a factor."""
    images = {
        "suit": png(32, cloth(RED, OCHER)),
        "suit_orm": png(32, lambda u, v: (0.6 + 0.4 * wave(u, v, 1, 2), 0.35 + 0.5 * wave(u, v, 2, 1), 0.0)),
        "face": png(32, cloth(SKIN, (0.8, 0.5, 0.42), 2, 3)),
        "face_mr": png(16, lambda _u, v: (0.0, 0.5 + 0.5 * v, 0.0)),
    }
    suit = material(
        "Suit",
        base={"baseColorTexture": texture("suit"), "metallicRoughnessTexture": texture("suit_orm")},
        occlusionTexture=texture("suit_orm", strength=0.8),
    )
    face = material(
        "Face",
        base={"baseColorTexture": texture("face"), "metallicRoughnessTexture": texture("face_mr"), "roughnessFactor": 0.8},
    )
    return _file("Packed ORM", images, {"head": face, "body": suit, "arms": suit, "legs": suit})


def metal_in_parts() -> bytes:
    """An image with metal in it, Metallic 1 and 0.5 as values, and a part without metal."""
    images = {
        "armor": png(32, cloth((0.9, 0.85, 0.7), BLUE, 2, 4)),
        "armor_mr": png(32, lambda u, v: (0.0, 0.3 + 0.4 * wave(u, v, 1, 1), float((int(2 * u) + int(4 * v)) % 2))),
    }
    armor = material("Armor", base={"baseColorTexture": texture("armor"), "metallicRoughnessTexture": texture("armor_mr")})
    helmet = material("Helmet", base={"baseColorFactor": [1.0, 0.77, 0.34, 1.0], "roughnessFactor": 0.35})
    gloves = material("Gloves", base={"baseColorFactor": [0.5, 0.4, 0.35, 1.0], "metallicFactor": 0.5, "roughnessFactor": 0.5})
    boots = material("Boots", base={"baseColorFactor": [0.1, 0.06, 0.04, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.9})
    return _file("Metal", images, {"head": helmet, "body": armor, "arms": gloves, "legs": boots})


def tint_times_image() -> bytes:
    """Base colors that are an image times a color, and one that is the color alone."""
    images = {"cloth": png(32, cloth(WHITE, GRAY, 6, 8)), "face": png(32, cloth(WHITE, SKIN, 2, 3))}
    shirt = material(
        "Shirt",
        base={
            "baseColorTexture": texture("cloth"),
            "baseColorFactor": [0.8, 0.3, 0.15, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.8,
        },
    )
    face = material(
        "Face",
        base={
            "baseColorTexture": texture("face"),
            "baseColorFactor": [0.7, 0.5, 0.4, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.6,
        },
    )
    boots = material("Boots", base={"baseColorFactor": [0.12, 0.2, 0.4, 1.0], "metallicFactor": 0.0, "roughnessFactor": 1.0})
    return _file("Tint", images, {"head": face, "body": shirt, "arms": shirt, "legs": boots})


def vertex_color() -> bytes:
    """Base colors that are vertex colors alone, and vertex colors times an image times a color."""
    images = {"tattoo": png(32, cloth(WHITE, GRAY, 3, 5))}
    paint = material("Paint", base={"metallicFactor": 0.0, "roughnessFactor": 0.7})
    face = material(
        "Tattoo",
        base={
            "baseColorTexture": texture("tattoo"),
            "baseColorFactor": [0.9, 0.8, 0.6, 1.0],
            "metallicFactor": 0.0,
            "roughnessFactor": 0.5,
        },
    )

    def color(u: float, v: float) -> Vector:
        return 0.15 + 0.8 * u, 0.9 - 0.8 * v, 0.2 + 0.6 * wave(u, v, 2, 3), 1.0

    return _file("Vertex Color", images, {"head": face, "body": paint, "arms": paint, "legs": paint}, color=color)


def normal_and_roughness() -> bytes:
    """A normal map of strength 0.8 and a roughness map on UVs whose halves are mirrored."""
    depth = 0.35  # slope

    def normal(u: float, v: float) -> Vector:
        along_u = depth * math.cos(2.0 * math.pi * (4.0 * u + v))
        along_v = -depth * math.cos(2.0 * math.pi * (u - 3.0 * v))
        length = math.hypot(along_u, along_v, 1.0)
        return tuple(0.5 + 0.5 * component / length for component in (along_u, along_v, 1.0))

    images = {
        "hide": png(32, cloth(GREEN, OCHER, 3, 4)),
        "hide_normal": png(64, normal),
        "hide_roughness": png(32, lambda u, v: (0.0, 0.3 + 0.6 * wave(u, v, 1, 2), 1.0)),
    }
    hide = material(
        "Hide",
        base={
            "baseColorTexture": texture("hide"),
            "metallicRoughnessTexture": texture("hide_roughness"),
            "metallicFactor": 0.0,
        },
        normalTexture=texture("hide_normal", scale=0.8),
    )
    return _file("Normal Map", images, dict.fromkeys(("head", "body", "arms", "legs"), hide), mirrored=True)


def alpha() -> bytes:
    """Alpha of an image: 1 everywhere though blended, holes that are cut out, a veil that blends, and one that is to be ignored."""

    def holes(u: float, v: float) -> Vector:
        return *cloth(BLUE, OCHER)(u, v), min(max(2.0 * wave(u, v, 3, 4) - 0.2, 0.0), 1.0)

    images = {
        "face": png(32, lambda u, v: (*cloth(SKIN, RED, 2, 3)(u, v), 1.0)),
        "mail": png(32, holes),
        "veil": png(32, lambda u, v: (*cloth(WHITE, GREEN)(u, v), 0.25 + 0.7 * v)),
    }
    matte = {"metallicFactor": 0.0, "roughnessFactor": 0.8}
    face = material("Face", base={"baseColorTexture": texture("face"), **matte}, alphaMode="BLEND")
    mail = material(
        "Mail", base={"baseColorTexture": texture("mail"), **matte}, alphaMode="MASK", alphaCutoff=0.4, doubleSided=True
    )
    veil = material(
        "Veil", base={"baseColorTexture": texture("veil"), "baseColorFactor": [1.0, 1.0, 1.0, 0.8], **matte}, alphaMode="BLEND"
    )
    boots = material("Boots", base={"baseColorTexture": texture("veil"), **matte})
    return _file("Alpha", images, {"head": face, "body": mail, "arms": veil, "legs": boots})


def emission_and_texture_transform() -> bytes:
    """Emission of an image and of a value with a strength above 1; a texture transform on a second UV map, and an empty one."""
    images = {
        "cloth": png(32, cloth(RED, BLUE, 5, 6)),
        "glow": png(32, lambda u, v: tuple(wave(u, v, 3, 2) ** 3 * value for value in (1.0, 0.8, 0.5))),
    }
    matte = {"metallicFactor": 0.0, "roughnessFactor": 0.9}
    face = material(
        "Glowing Face",
        base={"baseColorFactor": [0.1, 0.08, 0.06, 1.0], **matte},
        emissiveTexture=texture("glow"),
        emissiveFactor=[1.0, 0.9, 0.6],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 2.0}},
    )
    transform = {"offset": [0.1, 0.25], "rotation": 0.4, "scale": [2.0, 1.5]}
    shirt = material(
        "Shirt",
        base={
            "baseColorTexture": texture("cloth", texCoord=1, extensions={"KHR_texture_transform": transform}),
            **matte,
        },
    )
    lamps = material("Lamps", base={"baseColorFactor": [0.0, 0.0, 0.0, 1.0], **matte}, emissiveFactor=[0.2, 0.6, 1.0])
    boots = material("Boots", base={"baseColorTexture": texture("cloth", extensions={"KHR_texture_transform": {}}), **matte})
    return _file("Emission", images, {"head": face, "body": shirt, "arms": lamps, "legs": boots}, second_uv_map=True)


GLTF_FILES: Mapping[str, Callable[[], bytes]] = {
    f"{build.__name__}.glb": build
    for build in (
        packed_orm,
        metal_in_parts,
        tint_times_image,
        vertex_color,
        normal_and_roughness,
        alpha,
        emission_and_texture_transform,
    )
}


def _file(
    name: str,
    images: Mapping[str, bytes],
    materials: Mapping[str, dict[str, Json]],
    *,
    color: Callable[[float, float], Vector] | None = None,
    mirrored: bool = False,
    second_uv_map: bool = False,
) -> bytes:
    """Return a figure with the `materials` of its parts; parts of the same material become one primitive."""
    primitives: list[Primitive] = []
    for key, part in figure(mirrored).items():
        vertex_colors = colors(part, color) if color else []
        same = next((primitive for primitive in primitives if primitive.material is materials[key]), None)
        if same is None:
            primitives.append(Primitive(part, materials[key], vertex_colors))
        else:
            same.part.add(part)
            same.colors = [*same.colors, *vertex_colors]
    return glb(name, primitives, images, second_uv_map)
