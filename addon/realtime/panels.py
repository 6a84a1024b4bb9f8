# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's settings in the properties, and Blender's own panels that it shows."""

import textwrap
from collections.abc import Iterator
from fnmatch import fnmatchcase

import bpy

from ..blender.object_types import WITH_FACES
from . import not_drawn
from .engine import IDENTIFIER
from .passes import DATA_PASSES

GENERIC = "BLENDER_RENDER"  # in COMPAT_ENGINES of panels for any engine
IGNORED = (  # patterns of generic panels whose settings the engine does not follow, or for which it has panels of its own
    "DATA_PT_light",
    "DATA_PT_lightprobe*",
    "DATA_PT_preview",
    "DATA_PT_spot",
    "DATA_PT_volume_render",
    "OBJECT_PT_shading",  # light linking
    "PARTICLE_PT_render_path_timing",
    "PHYSICS_PT_fluid_domain_render",
    "RENDER_PT_simplify*",  # also to have Sampling come first, as panels of one order stand as they were registered
)
FOLLOWED = {  # panels for EEVEE whose settings the engine follows
    "DATA_PT_camera_dof",
    "DATA_PT_camera_dof_aperture",
    "EEVEE_MATERIAL_PT_context_material",
    "EEVEE_MATERIAL_PT_surface",
    "EEVEE_WORLD_PT_surface",
    "VIEWLAYER_PT_override",
}
SIMPLIFIED_STROKES = (  # settings of Simplify of Grease Pencil
    "simplify_gpencil_onplay",
    "simplify_gpencil_view_fill",
    "simplify_gpencil_modifier",
    "simplify_gpencil_shader_fx",
    "simplify_gpencil_tint",
    "simplify_gpencil_antialiasing",
)
ALWAYS = "Further bounces of light, and sharp reflections of objects, are never drawn"  # in any scene
LETTER, MARGINS = 6.2, 60.0  # width of a letter, and of what stands beside a line of text [pixels at Resolution Scale 1]


class EnginePanel:
    """Base of the engine's panels in the properties."""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    COMPAT_ENGINES = frozenset({IDENTIFIER})
    layout: bpy.types.UILayout

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.engine in cls.COMPAT_ENGINES


class TRUE_DIFFUSE_PT_sampling(EnginePanel, bpy.types.Panel):
    """Samples of the realtime engine"""

    bl_label = "Sampling"
    bl_context = "render"

    def draw(self, context: bpy.types.Context) -> None:
        layout = split(self.layout)
        layout.use_property_decorate = False
        column = layout.column(align=True)
        column.prop(context.scene.true_diffuse, "viewport_samples", text="Viewport")
        column.prop(context.scene.true_diffuse, "samples", text="Render")
        layout.prop(context.scene.true_diffuse, "bounces_light")


class TRUE_DIFFUSE_PT_film(EnginePanel, bpy.types.Panel):
    """Filter and background of the picture"""

    bl_label = "Film"
    bl_context = "render"

    def draw(self, context: bpy.types.Context) -> None:
        column = split(self.layout).column()
        column.prop(context.scene.render, "filter_size")
        column.prop(context.scene.render, "film_transparent", text="Transparent")


class TRUE_DIFFUSE_PT_motion_blur(EnginePanel, bpy.types.Panel):
    """The shutter of the camera in final renders"""

    bl_label = "Motion Blur"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_motion_blur", text="")

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.render, split(self.layout)
        layout.active = settings.use_motion_blur
        column = layout.column()
        column.prop(settings, "motion_blur_position", text="Position")
        column.prop(settings, "motion_blur_shutter")
        layout.template_curve_mapping(settings, "motion_blur_shutter_curve")
        draw_wrapped(layout, context, "Each sample of a render is taken at another time; viewports show none", "INFO")


class TRUE_DIFFUSE_PT_not_drawn(EnginePanel, bpy.types.Panel):
    """What the last picture of the realtime engine lacks, and what it shows instead"""

    bl_label = "Not Drawn Here"
    bl_context = "render"

    def draw_header_preset(self, context: bpy.types.Context) -> None:
        if groups := not_drawn.grouped(not_drawn.omissions(context.scene) or ()):
            self.layout.label(text=str(len(groups)))

    def draw(self, context: bpy.types.Context) -> None:
        layout, found = self.layout, not_drawn.omissions(context.scene)
        for group in not_drawn.grouped(found or ()):
            column = layout.column(align=True)
            draw_wrapped(column, context, group.heading, group.icon)
            names = column.column(align=True)
            names.active = False  # dimmed
            draw_wrapped(names, context, group.listed, "BLANK1")
        if found is None:
            draw_wrapped(layout, context, "Listed with the first picture, in a viewport or a render", "INFO")
        draw_wrapped(layout, context, ALWAYS, "INFO")


class TRUE_DIFFUSE_PT_simplify(EnginePanel, bpy.types.Panel):
    """What of Blender's Simplify counts in the realtime engine"""

    bl_label = "Simplify"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "use_simplify", text="")

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.render, split(self.layout)
        layout.active = settings.use_simplify
        for heading, suffix in (("Viewport", ""), ("Render", "_render")):
            column = layout.column(align=True)
            column.prop(settings, f"simplify_subdivision{suffix}", text=f"{heading} Subdivision")
            column.prop(settings, f"simplify_child_particles{suffix}", text="Child Particles")


class TRUE_DIFFUSE_PT_simplify_grease_pencil(EnginePanel, bpy.types.Panel):
    """What is simplified of Grease Pencil, which Blender draws over the engine's picture"""

    bl_label = "Grease Pencil"
    bl_context = "render"
    bl_parent_id = "TRUE_DIFFUSE_PT_simplify"
    bl_options = {"DEFAULT_CLOSED"}

    def draw_header(self, context: bpy.types.Context) -> None:
        self.layout.prop(context.scene.render, "simplify_gpencil", text="")

    def draw(self, context: bpy.types.Context) -> None:
        settings, layout = context.scene.render, split(self.layout)
        layout.use_property_decorate = False
        layout.active = settings.use_simplify and settings.simplify_gpencil
        column = layout.column()
        for name in SIMPLIFIED_STROKES:
            column.prop(settings, name)


class TRUE_DIFFUSE_PT_compositor(EnginePanel, bpy.types.Panel):
    """Where Blender's compositor runs"""

    bl_label = "Compositor"
    bl_context = "render"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context: bpy.types.Context) -> None:
        layout = split(self.layout)
        layout.use_property_decorate = False
        settings = context.scene.render
        column = layout.column()
        column.row().prop(settings, "compositor_device", text="Device", expand=True)
        if settings.compositor_device == "GPU":
            column.prop(settings, "compositor_precision", text="Precision")
        column.row().prop(settings, "compositor_denoise_device", text="Denoising", expand=True)


class TRUE_DIFFUSE_PT_ray_visibility(EnginePanel, bpy.types.Panel):
    """Whether the camera and other surfaces see the object and whether it casts shadows"""

    bl_label = "Ray Visibility"
    bl_context = "object"
    bl_parent_id = "OBJECT_PT_visibility"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.object is not None and context.object.type in WITH_FACES | {"CURVES"}

    def draw(self, context: bpy.types.Context) -> None:
        column = split(self.layout).column()
        column.prop(context.object, "visible_camera", text="Camera", toggle=False)
        column.prop(context.object, "visible_diffuse", text="Diffuse", toggle=False)
        column.prop(context.object, "visible_shadow", text="Shadow", toggle=False)


class TRUE_DIFFUSE_PT_passes(EnginePanel, bpy.types.Panel):
    """The passes that the realtime engine renders"""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: bpy.types.Context) -> None:
        layout = split(self.layout)
        layout.use_property_decorate = False
        column = layout.column()
        column.prop(context.view_layer, "use_pass_combined")
        column.prop(context.view_layer, "use_pass_z")
        for data in DATA_PASSES:
            column.prop(context.view_layer, data.setting)
        column.prop(context.view_layer, "use_pass_grease_pencil", text="Grease Pencil")
        column.prop(context.view_layer, "pass_alpha_threshold")


class TRUE_DIFFUSE_PT_world(EnginePanel, bpy.types.Panel):
    """How the realtime engine makes light of a world that varies"""

    bl_label = "Light"
    bl_context = "world"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.world is not None

    def draw(self, context: bpy.types.Context) -> None:
        from .world import RAYS  # not before it is used: enabling must stay quick

        layout, world = split(self.layout), context.world
        column = layout.column()
        column.prop(world, "sun_threshold", text="Suns Above")
        column.prop(world, "use_sun_shadow", text="Cast Shadow")
        column.prop(world, "probe_resolution", text="Reflection Resolution")
        draw_wrapped(
            layout, context, "Small places brighter than this become suns; a Sky Texture's sun is one at any strength", "INFO"
        )
        if hasattr(world, "cycles_visibility"):  # where Cycles is enabled
            column = layout.column(heading="Visible to")
            for ray in RAYS:
                column.prop(world.cycles_visibility, ray)


class LightPanel(EnginePanel):
    """Base of panels of a light's data."""

    bl_context = "data"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light is not None


class TRUE_DIFFUSE_PT_light(LightPanel, bpy.types.Panel):
    """The settings of a light that the realtime engine follows"""

    bl_label = "Light"

    def draw(self, context: bpy.types.Context) -> None:
        layout, light = self.layout, context.light
        layout.row().prop(light, "type", expand=True)
        split(layout)
        column = layout.column()
        row = column.row(align=True, heading="Temperature")
        row.prop(light, "use_temperature", text="")
        temperature = row.row(align=True)
        temperature.active = light.use_temperature
        temperature.prop(light, "temperature", text="")
        column.prop(light, "color", text="Tint" if light.use_temperature else "Color")
        layout.separator()
        column = layout.column()
        column.prop(light, "energy", text="Strength" if light.type == "SUN" else "Power")
        column.prop(light, "exposure")
        column.prop(light, "normalize")
        layout.separator()
        draw_light_size(layout.column(), light)
        layout.prop(light, "use_shadow", text="Cast Shadow")
        draw_wrapped(layout, context, "Shadows are sampled: more samples, smoother shadows", "INFO")


class TRUE_DIFFUSE_PT_light_beam(LightPanel, bpy.types.Panel):
    """The cone of a spot, the spread of an area light"""

    bl_label = "Beam Shape"
    bl_parent_id = "TRUE_DIFFUSE_PT_light"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.light.type in {"SPOT", "AREA"}

    def draw(self, context: bpy.types.Context) -> None:
        column, light = split(self.layout).column(), context.light
        if light.type == "AREA":
            column.prop(light, "spread")
            return
        column.prop(light, "spot_size", text="Angle")
        column.prop(light, "spot_blend", text="Blend", slider=True)
        column.prop(light, "show_cone")


class TRUE_DIFFUSE_PT_material_settings(EnginePanel, bpy.types.Panel):
    """The settings of a material that the realtime engine follows"""

    bl_label = "Settings"
    bl_context = "material"
    bl_options = {"DEFAULT_CLOSED"}

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return super().poll(context) and context.material is not None and not context.material.grease_pencil

    def draw(self, context: bpy.types.Context) -> None:
        column = split(self.layout).column()
        column.prop(context.material, "use_backface_culling")
        column.prop(context.material, "pass_index")


PANELS = (
    TRUE_DIFFUSE_PT_sampling,
    TRUE_DIFFUSE_PT_film,
    TRUE_DIFFUSE_PT_motion_blur,
    TRUE_DIFFUSE_PT_not_drawn,
    TRUE_DIFFUSE_PT_simplify,
    TRUE_DIFFUSE_PT_simplify_grease_pencil,
    TRUE_DIFFUSE_PT_compositor,
    TRUE_DIFFUSE_PT_passes,
    TRUE_DIFFUSE_PT_ray_visibility,
    TRUE_DIFFUSE_PT_world,
    TRUE_DIFFUSE_PT_light,
    TRUE_DIFFUSE_PT_light_beam,
    TRUE_DIFFUSE_PT_material_settings,
)


def split(layout: bpy.types.UILayout) -> bpy.types.UILayout:
    """Return `layout`, which has its labels on the left from here on."""
    layout.use_property_split = True
    return layout


def draw_wrapped(layout: bpy.types.UILayout, context: bpy.types.Context, text: str, icon: str = "NONE") -> None:
    """Draw a text in as many lines as the region needs, with an icon before the first."""
    letters = int((context.region.width / context.preferences.system.ui_scale - MARGINS) / LETTER)
    column = layout.column(align=True)
    for line in textwrap.wrap(text, max(12, letters)):
        column.label(text=line, icon=icon)
        icon = "NONE" if icon == "NONE" else "BLANK1"


def draw_light_size(column: bpy.types.UILayout, light: bpy.types.Light) -> None:
    """Draw the light's size."""
    if light.type == "SUN":
        column.prop(light, "angle")
    elif light.type == "AREA":
        column.prop(light, "shape")
        sizes = column.column(align=True)
        has_sides = light.shape in {"RECTANGLE", "ELLIPSE"}
        sizes.prop(light, "size", text="Size X" if has_sides else "Size")
        if has_sides:
            sizes.prop(light, "size_y", text="Y")
    else:
        column.prop(light, "shadow_soft_size", text="Radius")


def is_shared(panel: type[bpy.types.Panel]) -> bool:
    """Return whether the engine shows a panel of Blender's."""
    name = panel.__name__.removeprefix("NODE_")  # the same panel in node editors, which shares COMPAT_ENGINES
    generic = GENERIC in getattr(panel, "COMPAT_ENGINES", ()) and not any(fnmatchcase(name, pattern) for pattern in IGNORED)
    return generic or name in FOLLOWED


def shared_panels() -> Iterator[type[bpy.types.Panel]]:
    """Yield Blender's own panels that apply to the engine."""
    waiting = list(bpy.types.Panel.__subclasses__())
    while waiting:
        panel = waiting.pop()
        waiting += panel.__subclasses__()
        if is_shared(panel):
            yield panel


def register() -> None:
    """Register the panels and have the engine show the shared ones."""
    for panel in PANELS:
        bpy.utils.register_class(panel)
    for panel in shared_panels():
        panel.COMPAT_ENGINES.add(IDENTIFIER)


def unregister() -> None:
    """Undo `register`."""
    for panel in shared_panels():
        panel.COMPAT_ENGINES.discard(IDENTIFIER)
    for panel in reversed(PANELS):
        bpy.utils.unregister_class(panel)
