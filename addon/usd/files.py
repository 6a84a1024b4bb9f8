# SPDX-License-Identifier: GPL-3.0-or-later
"""The image files of an export, as networks name them. No bpy, no pxr."""

from collections.abc import Mapping
from dataclasses import dataclass


class Unsupported(Exception):
    """What a network cannot hold: `what` it is, and the label of its `node` in Blender, which may be empty."""

    def __init__(self, node: str, what: str) -> None:
        super().__init__(f"{what} ({node})" if node else what)
        self.node, self.what = node, what


@dataclass(frozen=True)
class ImageFile:
    """An image's file by its path in the stage, and how its pixels are meant."""

    path: str
    color_space: str
    """By its name in MaterialX; empty for numbers that are no colors."""
    interop_id: str = ""
    """The color space by the name that color management systems share; empty where the configuration does not tell."""
    is_opaque: bool = True
    """Whether alpha is 1 everywhere."""
    is_gray: bool = False
    """Whether red, green and blue are equal everywhere."""
    is_known: bool = True
    """Whether MaterialX has the color space; else `color_space` is the nearest."""


class Files(dict[str, ImageFile]):
    """Files by the full name of the image in Blender. Raises Unsupported for one that has none.

    `attributes` are Blender's data types of the mesh's attributes by name, where they are known.
    """

    def __init__(self, files: Mapping[str, ImageFile] | None = None, attributes: Mapping[str, str] | None = None) -> None:
        super().__init__(files or {})
        self.attributes = dict(attributes or {})

    def __missing__(self, name: str) -> ImageFile:
        raise Unsupported("", f"the missing image {name}")
