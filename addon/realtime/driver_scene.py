# SPDX-License-Identifier: GPL-3.0-or-later
"""A scene on the graphics driver: where its objects are, the numbers and images of its materials, and how each part is drawn."""

from array import array
from collections.abc import Callable
from contextlib import suppress
from itertools import accumulate

import gpu

from ..material.sky import Atmosphere
from .driver import TRANSPARENT, missing_image, uniform_buffer, use_depth_test
from .expressions import Code, Image
from .materials import RenderMaterial, values_to_bytes
from .not_drawn import Omission
from .objects import MATRIX_BYTES, MATRIX_SIZE, Part
from .program import Variant
from .scene_bounds import SceneBounds
from .scene_cache import SceneCache
from .sky import sky_map
from .view import View
from .world_maps import WorldMaps

OBJECTS_ACROSS = 256  # in a row of the texture of matrices, as in shaders/realtime/objects.glsl


class DriverScene:
    """The scene of `cache` as the driver has it after `refresh`.

    `warnings` say what it lacks because of the driver. `draws` has the parts that the camera sees, by variant and material,
    `layers` those that other surfaces see, for ray bundles, and `casters` those that cast shadows, each with the code of its
    opacity, None where it is opaque. `caster_version` counts the changes of what a shadow map shows. `bounds` are those of all
    objects. `world` is the world's light.
    """

    def __init__(self, cache: SceneCache) -> None:
        self.cache = cache
        self.warnings: list[Omission] = []
        self.world = WorldMaps()
        self.draws: list[tuple[Variant, RenderMaterial, list[Part]]] = []
        self.layers: list[tuple[Variant, RenderMaterial, list[Part]]] = []
        self.casters: list[tuple[Part, Code | None]] = []
        self.caster_version = 0
        self.bounds: SceneBounds | None = None
        self._version = -1  # of `cache` that has been sent
        self._values: dict[Code, gpu.types.GPUUniformBuf] = {}
        self._images: dict[Image | Atmosphere, gpu.types.GPUTexture] = {}
        self._groups: dict[Part, list[int]] = {}
        self._matrices: array[float] | None = None
        self._casting: object = None  # what casts shadows, and where
        self._first: list[int] = []  # the index of the first object of each group in the texture of matrices
        # what draws a part: its batch, first and number of objects
        self._calls: dict[Part, tuple[gpu.types.GPUBatch, int, int]] = {}

    @property
    def has_transparent_casters(self) -> bool:
        """Whether something casts a shadow that differs from sample to sample."""
        return any(code is not None for _, code in self.casters)

    def refresh(self) -> bool:
        """Send to the driver what has changed in `cache` or in the pixels of its images; return whether there is anything."""
        cache = self.cache
        are_images_changed = self._refresh_images()
        are_images_changed |= self.world.refresh(cache.environment, cache.has_glossy)
        self.warnings += self.world.warnings
        cache.set_world_suns(self.world.suns)
        if cache.version == self._version:
            return are_images_changed
        self._version = cache.version
        materials = dict.fromkeys(cache.materials.values())
        codes = dict.fromkeys(code for material in materials for code in (material.code, material.shadow_code) if code is not None)
        self._values = {code: self._values.get(code) or uniform_buffer(values_to_bytes(code)) for code in codes}
        if cache.groups is not self._groups or cache.matrices is not self._matrices:
            self._place_objects()
        casters = [(part, cache.materials[part.material].shadow_code) for part in self._groups if part.casts_shadow]
        if casters != self.casters:
            self.casters = casters
            self.caster_version += 1
        attributes = {uid: material.attributes for uid, material in cache.materials.items()}
        drawn: dict[tuple[RenderMaterial, bool, bool], list[Part]] = {}
        bouncing: dict[tuple[RenderMaterial, bool], list[Part]] = {}
        has_layers = cache.lighting().bounce
        self._calls = {}
        for (part, group), first in zip(cache.groups.items(), self._first, strict=True):
            self._calls[part] = part.mesh.batches[part.slot, attributes[part.material]], first, len(group)
            if part.is_visible:
                drawn.setdefault((cache.materials[part.material], part.is_holdout, part.is_strip), []).append(part)
            if part.is_bouncing and has_layers:
                bouncing.setdefault((cache.materials[part.material], part.is_strip), []).append(part)
        draws = ((cache.variant(*key), key[0], parts) for key, parts in drawn.items())
        self.draws = sorted(draws, key=_program_order)
        layers = ((cache.layer_variant(*key), key[0], parts) for key, parts in bouncing.items())
        self.layers = sorted(layers, key=_program_order)
        return True

    def draw_surfaces(
        self, buffer: gpu.types.GPUFrameBuffer, view: View, sample: int, shader_of: Callable[[Variant], gpu.types.GPUShader]
    ) -> None:
        """Draw the nearest surface of every pixel of a sample of `view` into the bound `buffer`, by the shaders of `shader_of`."""
        view_block = uniform_buffer(view.to_bytes(self.cache.world, sample))
        use_depth_test()
        buffer.clear(color=TRANSPARENT, depth=1.0)
        gpu.state.front_facing_set(view.is_mirrored)  # a mirrored view reverses the winding of front faces
        for variant, material, parts in self.draws:
            shader = shader_of(variant)
            self.give_inputs(shader, view_block, material.code)
            for part in parts:
                self.draw_part(shader, part)
        gpu.state.front_facing_set(False)

    def draw_part(self, shader: gpu.types.GPUShader, part: Part) -> None:
        """Draw the objects that show a part, in one call."""
        batch, first, count = self._calls[part]
        shader.uniform_int("first_object", first)
        if part.mesh.points is not None:
            shader.uniform_sampler("strip_points", part.mesh.points)
        batch.draw_instanced(shader, instance_count=count)

    def give_objects(self, shader: gpu.types.GPUShader) -> None:
        """Have `shader` read where objects are."""
        shader.uniform_sampler("objects", self._objects)

    def give_inputs(self, shader: gpu.types.GPUShader, view_block: gpu.types.GPUUniformBuf, code: Code) -> None:
        """Have `shader` read a view, the objects, the numbers of `code` and its images; the compiler drops what it does not use."""
        shader.uniform_block("view", view_block)
        self.give_objects(shader)
        with suppress(ValueError):
            shader.uniform_block("material", self._values[code])
        for index, image in enumerate(code.images):
            with suppress(ValueError):
                shader.uniform_sampler(f"image_{index}", self._images[image])

    def _place_objects(self) -> None:
        """Send where all objects are, in the order of the groups."""
        groups, places = self.cache.groups, self.cache.matrices.tobytes()
        self._groups, self._matrices = groups, self.cache.matrices
        order = [index for group in groups.values() for index in group]
        self._first = list(accumulate((len(group) for group in groups.values()), initial=0))[:-1]
        rows = -(-len(order) // OBJECTS_ACROSS) or 1
        texels = array("f", b"".join(places[MATRIX_BYTES * index : MATRIX_BYTES * (index + 1)] for index in order))
        texels.frombytes(bytes(MATRIX_BYTES * (rows * OBJECTS_ACROSS - len(order))))
        texels[MATRIX_SIZE - 1 : MATRIX_SIZE * len(order) : MATRIX_SIZE] = array("f", (index + 1 for index in order))
        size = (OBJECTS_ACROSS * MATRIX_SIZE // 4, rows)
        self._objects = gpu.types.GPUTexture(size, format="RGBA32F", data=gpu.types.Buffer("FLOAT", len(texels), texels))
        self.bounds = SceneBounds(groups, self.cache.matrices, self.bounds)
        transparent = [part for part in groups if part.casts_shadow and self.cache.materials[part.material].is_transparent]
        casting = (self.bounds.casting, [(part, groups[part]) for part in transparent])
        if casting != self._casting:
            self._casting = casting
            self.caster_version += 1

    def _refresh_images(self) -> bool:
        """Send to the driver the images whose pixels have changed; return whether there are any."""
        before, self.warnings = self._images, []
        materials = self.cache.materials.values()
        self._images = {image: self._image(material, image) for material in materials for image in material.textures}
        is_changed = self._images != before
        self.caster_version += is_changed and self.has_transparent_casters
        return is_changed

    def _image(self, material: RenderMaterial, image: Image | Atmosphere) -> gpu.types.GPUTexture:
        """Return a sky's map or an image on the driver, or one pixel where it is missing, as in Blender, or too large."""
        if isinstance(image, Atmosphere):
            return sky_map(image)
        if not material.is_missing(image):
            try:
                return gpu.texture.from_image(material.images[image.name])
            except RuntimeError:
                what = "the graphics driver has no room for the image, which is not drawn"
                self.warnings.append(Omission("IMAGE_DATA", what, image.name))
        return missing_image()


def _program_order(draw: tuple[Variant, RenderMaterial, list[Part]]) -> tuple[str, str]:
    """Return what sorts draws so that those of one program follow each other."""
    return draw[0].model.stem, draw[0].inputs.text
