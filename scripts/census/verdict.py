# SPDX-License-Identifier: GPL-3.0-or-later
"""Whether a target carries a channel of a material: what it holds is compared with what Blender's nodes have. No bpy.

A factor may differ by TOLERANCE: a target may write the model's albedo in place of its color. Weights of layers, which targets
scale differently, need only be there. Where nodes do more than multiply, a network has to read the same images and attributes
and do something to them; glTF, which can only multiply, has to have them baked.
"""

import re
from collections.abc import Mapping, Sequence
from enum import StrEnum
from typing import TYPE_CHECKING

from true_diffuse.scripts.census.gltf_file import VERTEX_COLOR
from true_diffuse.scripts.census.values import CHANNELS, DEFAULT_UV_MAP, MISSING, ImageUse, Place, Value, identifier

if TYPE_CHECKING:
    from true_diffuse.scripts.census.pictures import Difference

TOLERANCE = 0.06
PLACE_TOLERANCE = 2e-3
WEIGHTS = {"emission", "coat", "sheen", "transmission", "anisotropy", "thin film", "subsurface", "specular"}
CUTOFF = {"MATH", "CUTOFF"}


class Verdict(StrEnum):
    """What became of a channel."""

    KEPT = "kept"
    BAKED = "baked"
    SAID = "said"
    LOST = "lost"
    NONE = "none"  # the target was not asked


def judge(
    channel: str, expected: Sequence[Value], candidates: Sequence[Value] | None, lines: Sequence[str], uv_maps: Sequence[str]
) -> Verdict:
    """Return the verdict on a channel, which should be one of `expected`.

    `candidates` are what a target holds, `lines` what it said of the material.
    `uv_maps` are the names of the mesh's UV maps, the active one first.
    """
    if MISSING in expected[0].operations:
        return Verdict.NONE
    named = [line for line in lines if mentions(line, channel)]
    if _is_held(channel, expected, candidates or (), uv_maps):
        return Verdict.KEPT
    if any("baked" in line.lower() for line in named) and any(candidate.images for candidate in candidates or ()):
        return Verdict.BAKED
    return Verdict.SAID if named else Verdict.LOST


def _is_held(channel: str, expected: Sequence[Value], candidates: Sequence[Value], uv_maps: Sequence[str]) -> bool:
    return any(matches(channel, one, candidate, uv_maps) for one in expected for candidate in candidates)


def judge_picture(
    channels: Sequence[str], difference: "Difference | None", close: float, lines: Sequence[str], has_failed: bool
) -> dict[str, str]:
    """Return the verdicts on the channels of a material by a picture of it, which may be so `close` to what it should be.

    A picture shows all channels at once: where it is not close and a line is about some of them, the others are not judged.
    """
    named = [channel for channel in channels if any(mentions(line, channel) for line in lines)]
    if has_failed:
        return dict.fromkeys(channels, Verdict.LOST)
    if difference is None or difference.rms <= close:
        seen = Verdict.NONE if difference is None else Verdict.KEPT
        return {channel: Verdict.SAID if channel in named and difference is None else seen for channel in channels}
    if not named:
        return dict.fromkeys(channels, Verdict.LOST)
    return {channel: Verdict.SAID if channel in named else Verdict.NONE for channel in channels}


def mentions(line: str, channel: str) -> bool:
    """Return whether a line is about a channel: by what is before its colon where that names any, else by the whole line."""
    head = line.partition(":")[0].lower()
    if any(_names(head, other) for other in CHANNELS):
        return _names(head, channel)
    return _names(line.lower(), channel)


def _names(text: str, channel: str) -> bool:
    words = CHANNELS.get(channel, (channel,))
    return text in words or any(re.search(rf"\b{word}", text) for word in words if word != "color")


def matches(channel: str, expected: Value, held: Value, uv_maps: Sequence[str]) -> bool:
    """Return whether `held` is what is `expected` on a channel."""
    if expected.is_constant:
        if not held.is_constant:
            return False
        if channel in WEIGHTS:
            return max(held.factor) > 0.0 if max(expected.factor) > 0.0 else True
        roots = (1.0, 0.5) if channel == "roughness" else (1.0,)
        return any(_near(expected.factor, tuple(abs(x) ** root for x in held.factor)) for root in roots)
    if not expected.images and not expected.attributes:
        return not held.is_constant or not expected.operations - {"MIX", "MATH", "MIX_SHADER", "CLAMP", "VECT_MATH"}
    if bool(expected.attributes) != bool(held.attributes) or not _same_attributes(expected, held):
        return False
    if not all(any(_same_image(use, other, channel, uv_maps) for other in held.images) for use in expected.images):
        return False
    if channel == "alpha" and expected.operations & CUTOFF:
        return True
    if expected.operations:
        return bool(held.operations)
    if channel in WEIGHTS or held.operations - {"ND_luminance_color3"}:
        return True
    return _near(expected.factor, held.factor)


def _near(one: Sequence[float], other: Sequence[float]) -> bool:
    return all(abs(a - b) <= max(TOLERANCE * abs(a), 0.01) for a, b in zip(one, other, strict=False))


def _same_attributes(expected: Value, held: Value) -> bool:
    if VERTEX_COLOR in held.attributes:
        return True
    names = {identifier(name) for name in held.attributes}
    return all(name == "" or identifier(name) in names for name in expected.attributes)


def _same_image(use: ImageUse, other: ImageUse, channel: str, uv_maps: Sequence[str]) -> bool:
    if use.image not in re.split(r"[-]", other.image):
        return False
    if channel != "alpha" and use.channel != "rgb" and other.channel not in (use.channel, "rgb", "g", "b", "r"):
        return False
    return _same_uv_map(use.uv_map, other.uv_map, uv_maps) and _same_places(use.places, other.places)


def _same_uv_map(name: str, other: str, uv_maps: Sequence[str]) -> bool:
    """Return whether both are the same UV map; a name that the mesh lacks is its active one, as in Blender."""
    if not uv_maps:
        return True
    wanted = name if name in uv_maps[1:] else uv_maps[0]
    if other.startswith("TEXCOORD_"):
        index = int(other.removeprefix("TEXCOORD_"))
        return index < len(uv_maps[1:]) and uv_maps[1:][index] == wanted
    return identifier(wanted) == identifier(uv_maps[0] if other == DEFAULT_UV_MAP else other)


def _same_places(places: Sequence[Place] | None, others: Sequence[Place] | None) -> bool:
    """Return whether both look up the same places of an image that repeats."""
    if places is None or others is None:
        return others is None
    (u, v), (x, y) = places[0], others[0]
    shift = round(u - x), round(v - y)
    return all(
        abs(a - c - shift[0]) <= PLACE_TOLERANCE and abs(b - d - shift[1]) <= PLACE_TOLERANCE
        for (a, b), (c, d) in zip(places, others, strict=True)
    )


def poorer(
    channels: Mapping[str, Sequence[Value]],
    native: Mapping[str, Sequence[Value]],
    ours: Mapping[str, Sequence[Value]],
    uv_maps: Sequence[str],
) -> list[str]:
    """Return the channels that Blender's own export of the unconverted material carries and ours does not."""
    return [
        channel
        for channel, expected in channels.items()
        if _is_held(channel, expected, native.get(channel, ()), uv_maps)
        and not _is_held(channel, expected, ours.get(channel, ()), uv_maps)
    ]
