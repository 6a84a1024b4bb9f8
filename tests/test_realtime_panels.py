# SPDX-License-Identifier: GPL-3.0-or-later
"""What the realtime engine shows in the properties: Blender's panels by a decided list, and its own."""

from collections.abc import Iterator
from types import SimpleNamespace

import bpy

import pytest

from true_diffuse.addon.blender.engines import EEVEE, REALTIME
from true_diffuse.addon.realtime import not_drawn, panels

pytestmark = pytest.mark.usefixtures("registered")

# Blender 5.2's panels for EEVEE in the properties. One that is in neither list has to be looked at: are its settings followed?
SHOWN = """
    CAMERA_PT_presets CAMERA_PT_safe_areas_presets DATA_PT_CURVES_attributes DATA_PT_camera DATA_PT_camera_animation
    DATA_PT_camera_background_image DATA_PT_camera_display DATA_PT_camera_display_composition_guides DATA_PT_camera_dof
    DATA_PT_camera_dof_aperture DATA_PT_camera_safe_areas
    DATA_PT_camera_safe_areas_center_cut DATA_PT_camera_stereoscopy DATA_PT_cone DATA_PT_context_camera DATA_PT_context_curves
    DATA_PT_context_light DATA_PT_context_lightprobe DATA_PT_context_mesh DATA_PT_context_pointcloud DATA_PT_context_speaker
    DATA_PT_context_volume DATA_PT_curves_animation DATA_PT_curves_surface DATA_PT_custom_props_camera
    DATA_PT_custom_props_curves DATA_PT_custom_props_light DATA_PT_custom_props_mesh DATA_PT_custom_props_pointcloud
    DATA_PT_custom_props_speaker DATA_PT_custom_props_volume DATA_PT_customdata DATA_PT_distance DATA_PT_lens
    DATA_PT_light_animation DATA_PT_mesh_animation DATA_PT_mesh_attributes DATA_PT_pointcloud_attributes DATA_PT_remesh
    DATA_PT_shape_keys DATA_PT_speaker DATA_PT_speaker_animation DATA_PT_texture_space DATA_PT_uv_texture
    DATA_PT_vertex_colors DATA_PT_vertex_groups DATA_PT_volume_animation DATA_PT_volume_file DATA_PT_volume_grids
    DATA_PT_volume_viewport_display DATA_PT_volume_viewport_display_slicing EEVEE_MATERIAL_PT_context_material
    EEVEE_MATERIAL_PT_surface EEVEE_MATERIAL_PT_viewport_settings EEVEE_WORLD_PT_surface MATERIAL_PT_animation
    MATERIAL_PT_custom_props OBJECT_PT_custom_props OBJECT_PT_visibility PARTICLE_PT_hair_dynamics_presets
    RENDER_PT_color_management RENDER_PT_color_management_advanced RENDER_PT_color_management_curves
    RENDER_PT_color_management_white_balance RENDER_PT_color_management_working_space RENDER_PT_encoding
    RENDER_PT_encoding_audio RENDER_PT_encoding_video RENDER_PT_format RENDER_PT_frame_range RENDER_PT_gpencil
    RENDER_PT_grease_pencil_render RENDER_PT_grease_pencil_viewport RENDER_PT_output RENDER_PT_output_color_management
    RENDER_PT_output_pixel_density RENDER_PT_output_views RENDER_PT_post_processing RENDER_PT_stamp RENDER_PT_stamp_burn
    RENDER_PT_stamp_note RENDER_PT_stereoscopy RENDER_PT_time_stretching STRIP_PT_custom_props VIEWLAYER_PT_context_layer
    VIEWLAYER_PT_layer VIEWLAYER_PT_override WORLD_PT_animation WORLD_PT_context_world WORLD_PT_custom_props
"""
HIDDEN = """
    DATA_PT_EEVEE_light DATA_PT_EEVEE_light_distance DATA_PT_EEVEE_light_influence DATA_PT_EEVEE_light_shadow
    DATA_PT_lightprobe_animation DATA_PT_lightprobe_bake
    DATA_PT_lightprobe_bake_capture DATA_PT_lightprobe_bake_clamping DATA_PT_lightprobe_bake_offset
    DATA_PT_lightprobe_bake_resolution DATA_PT_lightprobe_capture DATA_PT_lightprobe_display_eevee DATA_PT_lightprobe_eevee
    DATA_PT_lightprobe_parallax DATA_PT_preview DATA_PT_spot DATA_PT_volume_render EEVEE_MATERIAL_PT_displacement
    EEVEE_MATERIAL_PT_settings EEVEE_MATERIAL_PT_settings_surface EEVEE_MATERIAL_PT_settings_volume
    EEVEE_MATERIAL_PT_thickness EEVEE_MATERIAL_PT_volume EEVEE_WORLD_PT_lightprobe EEVEE_WORLD_PT_mist EEVEE_WORLD_PT_settings
    EEVEE_WORLD_PT_sun EEVEE_WORLD_PT_sun_shadow EEVEE_WORLD_PT_volume MATERIAL_PT_preview OBJECT_PT_shading
    OBJECT_PT_shadow_terminator PARTICLE_PT_render_path_timing PHYSICS_PT_fluid_domain_render
    RENDER_PT_eevee_clamping RENDER_PT_eevee_clamping_surface RENDER_PT_eevee_clamping_volume RENDER_PT_eevee_denoise
    RENDER_PT_eevee_depth_of_field RENDER_PT_eevee_film RENDER_PT_eevee_gi_approximation RENDER_PT_eevee_hair
    RENDER_PT_eevee_light_paths RENDER_PT_eevee_light_paths_intensity RENDER_PT_eevee_motion_blur
    RENDER_PT_eevee_motion_blur_curve RENDER_PT_eevee_performance RENDER_PT_eevee_performance_compositor
    RENDER_PT_eevee_performance_compositor_denoise_settings RENDER_PT_eevee_performance_memory
    RENDER_PT_eevee_performance_viewport RENDER_PT_eevee_raytracing RENDER_PT_eevee_sampling RENDER_PT_eevee_sampling_advanced
    RENDER_PT_eevee_sampling_render RENDER_PT_eevee_sampling_shadows RENDER_PT_eevee_sampling_viewport
    RENDER_PT_eevee_screen_trace RENDER_PT_eevee_volumes RENDER_PT_eevee_volumes_range RENDER_PT_simplify
    RENDER_PT_simplify_greasepencil RENDER_PT_simplify_render RENDER_PT_simplify_viewport SCENE_PT_eevee_light_probes
    VIEWLAYER_PT_eevee_layer_passes_data VIEWLAYER_PT_eevee_layer_passes_light VIEWLAYER_PT_filter VIEWLAYER_PT_layer_passes
    VIEWLAYER_PT_layer_passes_aov VIEWLAYER_PT_layer_passes_cryptomatte
"""
ANY_ENGINE = {"texture", "physics", "particle"}  # tabs of what Blender makes ahead of all engines: new panels of them are shown


class Recorder:
    """Stands in for Blender's UILayout: collects the names of the properties that are drawn, and the texts."""

    def __init__(self) -> None:
        self.names: set[str] = set()
        self.texts: list[str] = []

    def __getattr__(self, _name: str) -> "Recorder":
        return self

    def __call__(self, **_options: object) -> "Recorder":
        return self

    def prop(self, owner: object, name: str, **_options: object) -> None:
        assert hasattr(owner, name)
        self.names.add(name)

    def template_curve_mapping(self, owner: object, name: str) -> None:
        self.prop(owner, name)

    def label(self, text: str, **_options: object) -> None:
        self.texts.append(text)


def drawn(panel: type[bpy.types.Panel], **context: object) -> Recorder:
    """Return what `panel` draws where Blender has `context`; nothing where it is not shown."""
    layout = Recorder()
    where = SimpleNamespace(
        engine=REALTIME.identifier,
        scene=bpy.context.scene,
        preferences=SimpleNamespace(system=SimpleNamespace(ui_scale=1.0)),
        region=SimpleNamespace(width=280),
        **context,
    )
    if panel.poll(where):
        panel.draw(SimpleNamespace(layout=layout), where)
    return layout


def blender_panels() -> Iterator[type[bpy.types.Panel]]:
    """Yield the registered panels of the properties that say for which engines they are."""
    waiting = list(bpy.types.Panel.__subclasses__())
    while waiting:
        panel = waiting.pop()
        waiting += panel.__subclasses__()
        is_registered = panel not in panels.PANELS and hasattr(bpy.types, panel.__name__)
        if is_registered and getattr(panel, "bl_space_type", "") == "PROPERTIES" and hasattr(panel, "COMPAT_ENGINES"):
            yield panel


def test_panels_are_shown_as_decided_and_a_new_one_of_blender_is_noticed() -> None:
    shown, hidden = set(), set()
    for panel in blender_panels():
        name, engines = panel.__name__, panel.COMPAT_ENGINES
        if REALTIME.identifier in engines:
            if "freestyle" not in name and getattr(panel, "bl_context", "") not in ANY_ENGINE:
                shown.add(name)
        elif EEVEE.identifier in engines:
            hidden.add(name)
    assert shown == set(SHOWN.split())
    assert hidden == set(HIDDEN.split())


def test_a_panel_that_is_not_shown_shows_no_panel_below_it() -> None:
    """Blender draws a panel with its parent only: what the engine follows must not hang on a hidden panel."""
    shown = {panel.__name__ for panel in blender_panels() if REALTIME.identifier in panel.COMPAT_ENGINES}
    for panel in (*blender_panels(), *panels.PANELS):
        parent = getattr(panel, "bl_parent_id", "")
        if REALTIME.identifier in panel.COMPAT_ENGINES and parent and hasattr(getattr(bpy.types, parent), "COMPAT_ENGINES"):
            assert parent in shown or parent.startswith("TRUE_DIFFUSE"), panel


def test_render_tab_starts_with_sampling() -> None:
    """Panels stand by their order, then as they were registered, so that all of Blender's must have a higher order."""
    assert panels.PANELS[0].bl_label == "Sampling"
    for panel in blender_panels():
        is_top = getattr(panel, "bl_context", "") == "render" and not getattr(panel, "bl_parent_id", "")
        assert not is_top or REALTIME.identifier not in panel.COMPAT_ENGINES or panel.bl_order > 0, panel


def test_panels_in_node_editors_are_blenders() -> None:
    """Copies there share their engines with the panels of the properties, where a second panel of a light must not come in."""
    names = {name for name in dir(bpy.types) if name.startswith("NODE_DATA_PT_")}
    assert names  # Blender has them
    assert not [name for name in names if REALTIME.identifier in getattr(getattr(bpy.types, name), "COMPAT_ENGINES", ())]


@pytest.mark.parametrize(
    ("kind", "shape", "expected"),
    [
        ("POINT", "", {"shadow_soft_size", "use_shadow"}),
        ("SUN", "", {"angle", "use_shadow"}),
        ("SPOT", "", {"shadow_soft_size", "use_shadow", "spot_size", "spot_blend", "show_cone"}),
        ("AREA", "DISK", {"shape", "size", "spread", "use_shadow"}),
        ("AREA", "RECTANGLE", {"shape", "size", "size_y", "spread", "use_shadow"}),
    ],
)
def test_light_has_the_settings_that_are_drawn(kind: str, shape: str, expected: set[str]) -> None:
    light = bpy.data.lights.new("Light", kind)
    if shape:
        light.shape = shape
    names = {name for panel in panels.PANELS if "_light" in panel.__name__ for name in drawn(panel, light=light).names}
    always = {"type", "use_temperature", "temperature", "color", "energy", "exposure", "normalize"}
    assert names == always | expected


def test_motion_blur_and_passes_have_their_settings() -> None:
    names = {"motion_blur_position", "motion_blur_shutter", "motion_blur_shutter_curve"}
    assert drawn(panels.TRUE_DIFFUSE_PT_motion_blur).names == names
    shown = drawn(panels.TRUE_DIFFUSE_PT_passes, view_layer=bpy.context.view_layer).names
    assert {"use_pass_z", "use_pass_normal", "use_pass_object_index", "use_pass_diffuse_color", "pass_alpha_threshold"} <= shown


def test_world_has_the_settings_that_are_drawn() -> None:
    names = {"sun_threshold", "use_sun_shadow", "probe_resolution"}
    assert drawn(panels.TRUE_DIFFUSE_PT_world, world=bpy.data.worlds.new("World")).names >= names
    assert not drawn(panels.TRUE_DIFFUSE_PT_world, world=None).names


def test_object_that_is_drawn_can_be_hidden_from_the_camera_and_from_lights() -> None:
    cube = bpy.data.objects.new("Cube", bpy.data.meshes.new("Cube"))
    empty = bpy.data.objects.new("Empty", None)
    seen = {"visible_camera", "visible_diffuse", "visible_shadow"}
    assert drawn(panels.TRUE_DIFFUSE_PT_ray_visibility, object=cube).names == seen
    assert not drawn(panels.TRUE_DIFFUSE_PT_ray_visibility, object=empty).names


# ---- what settings ask for that is not drawn


def light_object(kind: str = "SUN", **settings: object) -> bpy.types.Object:
    light = bpy.data.lights.new("Light", kind)
    for name, value in settings.items():
        setattr(light, name, value)
    return link("Light", light)


def link(name: str, data: bpy.types.ID | None) -> bpy.types.Object:
    item = bpy.data.objects.new(name, data)
    bpy.context.scene.collection.objects.link(item)
    return item


def panoramic() -> None:
    bpy.context.scene.camera = link("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.camera.data.type = "PANO"


def spherical() -> None:
    bpy.context.scene.camera = link("Camera", bpy.data.cameras.new("Camera"))
    bpy.context.scene.camera.data.stereo.use_spherical_stereo = True
    bpy.context.scene.render.use_multiview = True


def with_passes() -> None:
    bpy.context.view_layer.use_pass_mist = True


def without_sky() -> None:
    bpy.context.view_layer.use_sky = False


def foggy() -> None:
    world = bpy.context.scene.world = bpy.data.worlds.new("World")
    tree = world.node_tree
    tree.links.new(tree.nodes.new("ShaderNodeVolumeScatter").outputs[0], tree.get_output_node("ALL").inputs["Volume"])


def linked() -> None:
    light_object().light_linking.receiver_collection = bpy.data.collections.new("Lit")


def colored_by_nodes() -> None:
    light = light_object().data
    tree = light.node_tree or bpy.data.node_groups.new("", "ShaderNodeTree")
    emission = next((node for node in tree.nodes if node.type == "EMISSION"), None)
    assert emission
    emission.inputs["Strength"].default_value = 2.0


def sharp() -> None:
    bpy.context.scene.render.use_motion_blur = True
    link("Sharp", bpy.data.meshes.new("Sharp")).cycles.use_motion_blur = False


SETTINGS = {
    "motion blur is not switched off for single objects (1): Sharp": sharp,
    "cameras that are neither perspective nor orthographic are not rendered (1): Camera": panoramic,
    "spherical stereo is not drawn (1): Camera": spherical,
    "passes stay empty (1): Mist": with_passes,
    "leaves these out, but they are drawn (1): Environment": without_sky,
    "volume is not drawn (1): World": foggy,
    "light probes are not drawn (1): Probe": lambda: link("Probe", bpy.data.lightprobes.new("Probe", "SPHERE")),
    "shadow catchers are drawn as other objects (1): Floor": lambda: setattr(
        link("Floor", bpy.data.meshes.new("Floor")), "is_shadow_catcher", True
    ),
    "light linking and shadow linking are not followed (1): Light": linked,
    "ray visibility of lights is not followed (1): Light": lambda: setattr(light_object(), "visible_glossy", False),
    "influence of lights is not followed (1): Light": lambda: light_object(diffuse_factor=0.5),
    "the custom distance of lights is not followed (2): Light, Light.001": lambda: (
        light_object("SPOT", use_custom_distance=True),
        light_object("POINT", use_custom_distance=True),
    ),
    "nodes of lights are not drawn (1): Light": colored_by_nodes,
}


def said() -> list[str]:
    """Return what settings ask for that is not drawn, as reports say it."""
    depsgraph = bpy.context.evaluated_depsgraph_get()
    return [str(group) for group in not_drawn.grouped(not_drawn.of_settings(depsgraph))]


@pytest.mark.parametrize("setting", SETTINGS)
def test_what_settings_ask_for_that_is_not_drawn_is_said_with_names(setting: str) -> None:
    for kind in ("SUN", "SPOT"):
        light_object(kind).name = "Drawn"
    link("Mesh", bpy.data.meshes.new("Mesh"))
    assert said() == []
    SETTINGS[setting]()
    (line,) = said()
    assert setting.lower() in line.lower()


def test_what_is_not_drawn_of_instances_is_said_once() -> None:
    collection = bpy.data.collections.new("Lights")
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.use_custom_distance = True
    collection.objects.link(bpy.data.objects.new("Lamp", lamp))
    for name in ("A", "B"):
        empty = link(name, None)
        empty.instance_type, empty.instance_collection = "COLLECTION", collection
    assert said() == ["The custom distance of lights is not followed (1): Lamp"]


def test_panel_lists_what_the_last_picture_lacks_with_names_and_counts() -> None:
    scene = bpy.context.scene
    before = " ".join(drawn(panels.TRUE_DIFFUSE_PT_not_drawn).texts)
    assert "first picture" in before
    names = [f"Skin {index}" for index in range(not_drawn.NAMES + 3)]
    not_drawn.keep(scene, [not_drawn.Omission("MATERIAL", "refraction is not drawn", name) for name in names])
    text = " ".join(drawn(panels.TRUE_DIFFUSE_PT_not_drawn).texts)
    assert f"Refraction is not drawn ({len(names)})" in text and "Skin 0, Skin 1," in text and "and 4 more" in text
