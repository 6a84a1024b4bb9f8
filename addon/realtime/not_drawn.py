# SPDX-License-Identifier: GPL-3.0-or-later
"""What the last picture of each scene lacks or shows in another way, for the panel of the render properties."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import bpy

from ..blender.wording import listed
from .passes import DATA_PASSES

FILTERS = {"use_sky": "Environment", "use_solid": "Surfaces"}  # of view layers: what a layer may leave out
PASSES = {"use_pass_combined", "use_pass_z", "use_pass_grease_pencil", "use_pass_cryptomatte_accurate"}  # rendered, or no pass
PASSES |= {data.setting for data in DATA_PASSES}
NAMES = 20  # of one group that the panel and reports list

_omissions: dict[int, tuple["Omission", ...]] = {}  # by the session_uid of the scene


class Omission(NamedTuple):
    """Something that is not drawn, or in another way: `what` in a clause, of the thing called `name`, empty for the whole scene.

    `icon` is that of the kind of thing, one of Blender's.
    """

    icon: str
    what: str
    name: str = ""

    def __str__(self) -> str:
        return f"{self.name}: {self.what}" if self.name else self.what


class Group(NamedTuple):
    """All things of which the same is to be said; `names` is empty where that is of the whole scene."""

    icon: str
    what: str
    names: tuple[str, ...]

    @property
    def heading(self) -> str:
        """What is not drawn, and of how many things."""
        heading = self.what[0].upper() + self.what[1:]
        return f"{heading} ({len(self.names)})" if self.names else heading

    @property
    def listed(self) -> str:
        """The names, the last of many counted."""
        return listed(self.names, NAMES)

    def __str__(self) -> str:
        return f"{self.heading}: {self.listed}" if self.names else self.heading


def omissions(scene: bpy.types.Scene) -> tuple[Omission, ...] | None:
    """Return what the last picture of `scene` lacks; None before there is one."""
    return _omissions.get(scene.original.session_uid)


def messages(scene: bpy.types.Scene) -> tuple[str, ...]:
    """Return what the last picture of `scene` lacks, one sentence each; none before there is one."""
    return tuple(map(str, omissions(scene) or ()))


def keep(scene: bpy.types.Scene, found: Iterable[Omission]) -> bool:
    """Keep what a picture of `scene` lacks; return whether that differs from the last, so that the properties are stale."""
    now = tuple(dict.fromkeys(found))
    if now == omissions(scene):
        return False
    _omissions[scene.original.session_uid] = now
    return True


def redraw_properties() -> None:
    """Have the properties drawn again."""
    manager = bpy.context.window_manager
    for area in (area for window in (manager.windows if manager else ()) for area in window.screen.areas):
        if area.type == "PROPERTIES":
            area.tag_redraw()


def grouped(found: Iterable[Omission]) -> list[Group]:
    """Return `found` with the names of all things together of which the same is to be said."""
    names: dict[tuple[str, str], dict[str, None]] = {}
    for icon, what, name in found:
        names.setdefault((icon, what), {}).update({name: None} if name else {})
    return [Group(icon, what, tuple(found)) for (icon, what), found in names.items()]


def of_settings(depsgraph: bpy.types.Depsgraph) -> Iterator[Omission]:
    """Yield what settings of the scene, its view layer, camera, world and objects ask for that the engine does not draw."""
    scene, layer = depsgraph.scene, depsgraph.view_layer
    if scene.camera and scene.camera.type == "CAMERA":
        for what in _of_camera(scene.camera.data, scene.render.use_multiview):
            yield Omission("CAMERA_DATA", what, scene.camera.name)
    passes = [item.name for item in layer.bl_rna.properties if _is_pass(item.identifier) and getattr(layer, item.identifier)]
    for name in (*passes, *(aov.name for aov in layer.aovs)):
        yield Omission("RENDERLAYERS", "passes stay empty", name)
    for setting, name in FILTERS.items():
        if not getattr(layer, setting):
            yield Omission("RENDERLAYERS", "the view layer leaves these out, but they are drawn", name)
    world = layer.world_override or scene.world
    output = world.node_tree.get_output_node("ALL") if world and world.node_tree else None
    if output and output.inputs["Volume"].is_linked:
        yield Omission("WORLD", "the world's volume is not drawn", world.name)
    if len(depsgraph.object_instances) == len(depsgraph.objects):
        items = list(depsgraph.objects)
    else:
        items = list({instance.object.original: instance.object for instance in depsgraph.object_instances}.values())
    for item in items:
        for icon, what in _of_light(item) if item.type == "LIGHT" else _of_object(item, scene.render.use_motion_blur):
            yield Omission(icon, what, item.name)


def of_light_through(curves: Iterable[str], has_lights: bool, is_even: bool, is_black: bool) -> Iterator[Omission]:
    """Yield what does not come through thin matter, of a scene that has some.

    `curves`: the names of the translucent materials of curves. The light of a world that `is_even` comes through what lights show
    to be thin. `is_black` says whether the even one is.
    """
    for name in curves:
        yield Omission("MATERIAL", "no light comes through curves", name)
    if not is_even:
        yield Omission("WORLD", "of the world's light, only that of its suns comes through thin matter")
    elif not (has_lights or is_black):
        yield Omission("WORLD", "the world's light comes through thin matter only where a light shines")


def _is_pass(setting: str) -> bool:
    return setting.startswith("use_pass_") and setting not in PASSES


def _of_camera(camera: bpy.types.Camera, is_stereoscopic: bool) -> Iterator[str]:
    """Yield what is not drawn of the scene's camera."""
    if camera.type not in {"PERSP", "ORTHO"}:
        yield "cameras that are neither perspective nor orthographic are not rendered"
    if is_stereoscopic and camera.stereo.use_spherical_stereo:
        yield "spherical stereo is not drawn"


def _of_object(item: bpy.types.Object, is_blurred: bool) -> Iterator[tuple[str, str]]:
    """Yield an icon and what is not drawn of an object that is no light; `is_blurred`: by motion, as the scene says."""
    if item.type == "LIGHT_PROBE":
        yield "OUTLINER_OB_LIGHTPROBE", "light probes are not drawn"
    if item.is_shadow_catcher:
        yield "OBJECT_DATA", "shadow catchers are drawn as other objects"
    if is_blurred and hasattr(item, "cycles") and not item.cycles.use_motion_blur:
        yield "OBJECT_DATA", "motion blur is not switched off for single objects"


def _of_light(item: bpy.types.Object) -> Iterator[tuple[str, str]]:
    """Yield an icon and what is not drawn of a light."""
    light, linking = item.data, item.light_linking
    icon = "LIGHT"
    if linking.receiver_collection or linking.blocker_collection:
        yield icon, "light linking and shadow linking are not followed"
    if not (item.visible_diffuse and item.visible_glossy and item.visible_transmission):
        yield icon, "ray visibility of lights is not followed"
    if (light.diffuse_factor, light.specular_factor, light.transmission_factor) != (1.0, 1.0, 1.0):
        yield icon, "influence of lights is not followed"
    if light.use_custom_distance:
        yield icon, "the custom distance of lights is not followed"
    if light.node_tree and not _is_plain(light.node_tree):
        yield icon, "nodes of lights are not drawn"
    if light.type == "AREA" and hasattr(light, "cycles") and light.cycles.is_portal:
        yield icon, "portals are drawn as lights"


def _is_plain(tree: bpy.types.NodeTree) -> bool:
    """Return whether the nodes of a light leave it as it is, as those do that Blender gives it."""
    output = tree.get_output_node("ALL")
    links = output.inputs["Surface"].links if output else ()
    if not links or links[0].from_node.type != "EMISSION":
        return False
    color, strength = (links[0].from_node.inputs[name] for name in ("Color", "Strength"))
    return not (color.is_linked or strength.is_linked) and (*color.default_value[:3], strength.default_value) == (1.0,) * 4
