# SPDX-License-Identifier: GPL-3.0-or-later
"""The base color: that of the EON, or Lambert, that reflects as much light from everywhere as the reflectance model does."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from ..material.expression import Constant
from ..material.links import Place
from ..material.surface import Loss, texture_factor
from ..models.geometry import clamp
from .diffuse import NEGLIGIBLE, Diffuse
from .inputs import varies
from .stand_in import Replaced

if TYPE_CHECKING:
    from io_scene_gltf2.io.com.gltf2_io import MaterialPBRMetallicRoughness


def adjust(base: "MaterialPBRMetallicRoughness", replaced: Replaced, diffuse: Diffuse) -> Iterator[Loss]:
    """Give the base color that of `diffuse`: exact for a constant; an image or a color attribute can only be scaled."""
    scale = texture_factor(diffuse.color)
    if diffuse.color_varies:
        words = diffuse.surface.model_parameter.removeprefix("diffuse_").replace("ior", "IOR")
        what, mean = f"what feeds the {words} of {diffuse.model.label}", replaced.mean_roughness
        whose = "the socket's own value" if mean is None else f"its mean, {mean:.2g},"
        yield Loss("base_color", replaced.label, what, f"the average albedo of {whose} is written")
    if not isinstance(diffuse.surface["metallic"], Constant) and abs(scale - 1.0) > NEGLIGIBLE:
        what = f"the albedo of {diffuse.model.label}, {scale:.3g} times Lambert's, beside a metal that varies"
        yield Loss("base_color", replaced.label, what, "the color is written as it is")
        return
    red, green, blue, alpha = base.base_color_factor or (1.0, 1.0, 1.0, 1.0)
    if varies(Place(replaced.principled.inputs["Base Color"], replaced.groups)):
        red, green, blue = (clamp(scale * channel, 0.0, 1.0) for channel in (red, green, blue))
    else:
        red, green, blue = map(diffuse.color, (red, green, blue))
    if base.base_color_factor or (red, green, blue) != (1.0, 1.0, 1.0):
        base.base_color_factor = [red, green, blue, alpha]
