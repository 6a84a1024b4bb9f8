# SPDX-License-Identifier: GPL-3.0-or-later
"""The objects that a depsgraph shows, instances included: what draws alike as one, and a matrix for each."""

from array import array
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

import bpy

from mathutils import Matrix

from .meshes import LARGEST, Geometry

MATRIX_SIZE = 16  # floats
MATRIX_BYTES = 4 * MATRIX_SIZE

type IsShown = Callable[[bpy.types.Object], bool]
type Identity = tuple[object, ...]
"""Equal for two readings of a depsgraph that show the same objects in the same order."""


@dataclass(frozen=True, slots=True)
class Part:
    """The faces of one material slot of a mesh, or curves, drawn in one way for all objects that show them.

    `material` is the material's key in SceneCache.materials; `is_visible` to the camera; `is_holdout` cuts a hole into the picture;
    `is_bouncing`: other surfaces see it.
    """

    mesh: Geometry
    slot: int
    material: int
    is_visible: bool
    casts_shadow: bool
    is_holdout: bool = False
    is_bouncing: bool = True

    @property
    def is_strip(self) -> bool:
        """Whether it is drawn as strips along curves."""
        return self.mesh.points is not None


class Visibility(NamedTuple):
    """Whether the camera sees an object, it casts shadows, is a holdout, and is seen by rays that left a diffuse surface."""

    camera: bool
    shadow: bool
    holdout: bool
    diffuse: bool

    @classmethod
    def of(cls, item: bpy.types.Object) -> "Visibility":
        """Return what the object's own settings say."""
        return cls(item.visible_camera, item.visible_shadow, item.is_holdout, item.visible_diffuse)

    def with_owner(self, owner: "Visibility") -> "Visibility":
        """Return what is left of it in an instance that `owner` makes."""
        diffuse = self.diffuse and owner.diffuse
        return Visibility(self.camera and owner.camera, self.shadow and owner.shadow, self.holdout or owner.holdout, diffuse)

    def within_collections(self, item: bpy.types.Object, layer: bpy.types.ViewLayer) -> "Visibility":
        """Return what is left of it by the collections of a view layer that `item` is in: as in Cycles, a holdout is seen."""
        is_holdout = self.holdout or item.holdout_get(view_layer=layer)
        camera = self.camera and (is_holdout or not item.indirect_only_get(view_layer=layer))
        return self._replace(camera=camera, holdout=is_holdout)


def identity(depsgraph: bpy.types.Depsgraph, is_shown: IsShown | None) -> Identity:
    """Return what tells whether the same objects are shown as before."""
    objects = depsgraph.objects
    found: list[object] = [depsgraph.as_pointer(), [item.original.session_uid for item in objects], layer_collections(depsgraph)]
    count = len(depsgraph.object_instances)
    if count != len(objects):  # there are instances, too
        for name, kind in (("random_id", "I"), ("show_self", "b")):
            values = array(kind, bytes(array(kind).itemsize * count))
            depsgraph.object_instances.foreach_get(name, values)
            found.append(values)
    if is_shown is not None:
        found.append([is_shown(item) for item in objects])
    return tuple(found)


def layer_collections(depsgraph: bpy.types.Depsgraph) -> list[tuple[str, bool, bool]]:
    """Return the collections of the view layer that are a holdout or indirect only, with which of the two."""
    found = ((item.name, item.holdout, item.indirect_only) for item in _collections(depsgraph.view_layer_eval))
    return [item for item in found if item[1] or item[2]]


def has_hidden_collection(layer: bpy.types.ViewLayer) -> bool:
    """Return whether a collection is hidden in the viewports of a view layer, which keeps its objects in the depsgraph."""
    return any(item.hide_viewport for item in _collections(layer))


def _collections(layer: bpy.types.ViewLayer) -> Iterator[bpy.types.LayerCollection]:
    """Yield a view layer's collections, at any depth."""
    waiting = [layer.layer_collection]
    while waiting:
        collection = waiting.pop()
        waiting += collection.children
        yield collection


def matrices(depsgraph: bpy.types.Depsgraph) -> array[float]:
    """Return the matrix of each object to the world [m], column by column."""
    found = array("f", bytes(MATRIX_BYTES * len(depsgraph.object_instances)))
    depsgraph.object_instances.foreach_get("matrix_world", found)
    return found


def moved(before: array[float], now: array[float]) -> set[int]:
    """Return the objects whose matrices differ; there are as many in both."""
    old, new = before.tobytes(), now.tobytes()
    if old == new:
        return set()
    starts = range(0, len(new), MATRIX_BYTES)
    return {at // MATRIX_BYTES for at in starts if old[at : at + MATRIX_BYTES] != new[at : at + MATRIX_BYTES]}


def matrix(place: bytes) -> Matrix:
    """Return the matrix of one object from its bytes, as `matrices` has them."""
    numbers = memoryview(place).cast("f")
    return Matrix((numbers[0::4], numbers[1::4], numbers[2::4], numbers[3::4]))


def not_finite(numbers: array[float]) -> set[int]:
    """Return the objects whose matrices shaders cannot compute with."""
    if sum(map(abs, numbers)) < LARGEST:  # the sum may be NaN
        return set()
    return {at // MATRIX_SIZE for at, number in enumerate(numbers) if not abs(number) < LARGEST}
