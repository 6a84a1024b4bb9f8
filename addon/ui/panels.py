# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: Material properties > True Diffuse, the same in the Shader Editor's sidebar, and the error in Scene properties."""

import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import bpy

from ..operators.context import is_node_editor, material_of, node_of
from ..operators.convert import TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_convert_nodes
from ..operators.exports import TRUE_DIFFUSE_OT_check_exports, answers
from ..operators.lights import TRUE_DIFFUSE_OT_toggle_light, TRUE_DIFFUSE_OT_use_selected_lights
from ..operators.measure import TRUE_DIFFUSE_OT_measure, measurements
from ..operators.presets import SHADED, TRUE_DIFFUSE_OT_apply_preset
from ..operators.tolerance import TRUE_DIFFUSE_OT_pick_settings
from ..operators.upgrade import TRUE_DIFFUSE_OT_upgrade
from . import menus, plots
from .kept import keep

if TYPE_CHECKING:
    from ..material.summary import MaterialSummary

LINE_LENGTH = 34  # letters that fit into a sidebar beside an icon
CHANNELS = ("Red", "Green", "Blue")
MILLIMETERS, PRINCIPLED_MILLIMETERS = {"Subsurface Radius"}, {"Subsurface Scale"}  # inputs that are lengths
NARROWEST, WIDEST = 7.0, 13.0  # of a plot, times an icon's size


class TRUE_DIFFUSE_MT_apply(bpy.types.Menu):
    """Set this node to the values of a preset"""

    bl_label = "Presets"

    def draw(self, context: bpy.types.Context) -> None:
        from ..material.presets import PRESETS
        from ..nodes.graph import key_and_version

        node = node_of(context)
        presets = [preset for preset in PRESETS.values() if node and preset.group.key == key_and_version(node)[0]]
        menus.draw_pictures(self.layout, presets, TRUE_DIFFUSE_OT_apply_preset)


class MaterialPanel:
    """Base of the panels of a material."""

    bl_label = "True Diffuse"
    layout: bpy.types.UILayout

    def draw(self, context: bpy.types.Context) -> None:
        layout, material = self.layout, material_of(context)
        layout.use_property_split, layout.use_property_decorate = True, False
        if material is None:
            layout.label(text="No material")
            menus.draw_common(layout)
            return
        if material.override_library is not None:
            layout.label(text="Library override: its nodes cannot be changed", icon="LIBRARY_DATA_OVERRIDE")
        elif not material.is_editable:
            layout.label(text="Linked from another file", icon="LINKED")
        draw_material(layout, context, material)


class TRUE_DIFFUSE_PT_material(MaterialPanel, bpy.types.Panel):
    """The True Diffuse group of the material"""

    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return material_of(context) is not None or (context.object is not None and context.object.type in SHADED)


class TRUE_DIFFUSE_PT_node(MaterialPanel, bpy.types.Panel):
    """The active True Diffuse node, else the one of the material's surface"""

    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "True Diffuse"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.space_data.tree_type == "ShaderNodeTree" and material_of(context) is not None


class TRUE_DIFFUSE_PT_scene(bpy.types.Panel):
    """The error that quality and samples are picked for"""

    bl_label = "True Diffuse"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "scene"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        draw_error(self.layout, context.scene)


def draw_material(layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material) -> None:
    """Draw the whole panel of a material."""
    from ..material.materials import locked_reason
    from ..material.summary import node_summary

    node = node_of(context)
    summary = node_summary(node) if node else None
    if node is None or summary is None:
        draw_other(layout, context, node)
        return
    column = layout.column()
    column.enabled = node.id_data.is_editable and not locked_reason(material)
    draw_sockets(column, node)
    if summary.follows_lights:
        _section(layout, "lights", "Lights", lambda body: draw_lights(body, context.scene))
    _section(layout, "plot", "Plot", lambda body: draw_plots(body, context, summary))
    _section(layout, "accuracy", "Accuracy", lambda body: draw_accuracy(body, context.scene, material, summary))
    _section(layout, "carried", "Not Carried", lambda body: draw_carried(body, context, material))
    _section(layout, "error", "Error", lambda body: draw_error(body, context.scene))


def _section(layout: bpy.types.UILayout, key: str, title: str, draw: Callable[[bpy.types.UILayout], None]) -> None:
    """Draw a collapsible section under its `title`."""
    header, body = layout.panel(f"true_diffuse_{key}")
    header.label(text=title)
    if body:
        draw(body)


def draw_other(layout: bpy.types.UILayout, context: bpy.types.Context, node: bpy.types.Node | None) -> None:
    """Draw the panel of a material without one of our groups, or with a group of another version."""
    if node is not None:
        layout.label(text=f"{node.node_tree.name} is of another version", icon="ERROR")
        operator = TRUE_DIFFUSE_OT_upgrade
    else:
        layout.label(text="Not a True Diffuse material")
        operator = TRUE_DIFFUSE_OT_convert_nodes if is_node_editor(context) else TRUE_DIFFUSE_OT_convert
    layout.operator(operator.bl_idname)


def draw_sockets(layout: bpy.types.UILayout, node: bpy.types.Node) -> None:
    """Draw the node's inputs as the node editor does, in its panels; inputs without effect on the chosen model are dimmed."""
    from ..nodes import PRINCIPLED
    from ..nodes.graph import key_and_version

    layout.menu(TRUE_DIFFUSE_MT_apply.__name__)
    lengths = MILLIMETERS if key_and_version(node)[0] != PRINCIPLED.key else PRINCIPLED_MILLIMETERS
    items = [item for item in node.node_tree.interface.items_tree if item.item_type == "SOCKET" and item.in_out == "INPUT"]
    panels = {item.name: item.parent.name for item in items}
    bodies: dict[str, bpy.types.UILayout | None] = {"": layout}
    for socket in node.inputs:
        panel = panels.get(socket.name, "")
        if panel not in bodies:
            is_closed = panel != "Diffuse"  # which has Model and its roughness
            header, bodies[panel] = layout.panel(f"true_diffuse_sockets_{panel.lower()}", default_closed=is_closed)
            header.label(text=panel)
        body = bodies[panel]
        if body is None:
            continue
        row = body.column(align=True)
        row.active = not socket.is_inactive
        name = socket.name.removeprefix(f"{panel} ")  # as Blender's Principled BSDF has it
        if socket.name in lengths:
            name += " [mm]"
        if socket.is_linked:
            source = socket.links[0].from_node
            split = row.split(factor=0.4)
            label = split.row()
            label.alignment = "RIGHT"
            label.label(text=name)
            split.label(text=source.label or source.name, icon="LINKED")
        elif socket.name == "Subsurface Radius":
            row.label(text=name)
            for index, channel in enumerate(CHANNELS):
                row.prop(socket, "default_value", index=index, text=channel)
        elif not socket.hide_value and hasattr(socket, "default_value"):
            row.prop(socket, "default_value", text=name)


def draw_plots(layout: bpy.types.UILayout, context: bpy.types.Context, summary: "MaterialSummary") -> None:
    """Draw the lobe, and the profile below the surface where there is one, with captions of their axes."""
    from ..material.summary import engine_of
    from ..nodes import SUBSURFACE

    engine = engine_of(context.scene)
    key = (summary.group, *sorted((name, value) for name, value in summary.inputs.items() if name != "Normal"))
    is_subsurface = summary.group == SUBSURFACE.key
    if is_subsurface and summary.number("Subsurface") > 0.0:
        _plot(layout, context, plots.icon(("profile", key), lambda: plots.profile(summary)))
        _caption(
            layout,
            "Light by distance from where it enters",
            f"Across: 0 to {plots.profile_reach(summary):.3g} mm",
            f"Up: R(r) [1/mm²], {plots.DECADES} decades",
        )
    if not is_subsurface or summary.number("Subsurface") < 1.0:
        _plot(layout, context, plots.icon(("lobe", engine and engine.key, key), lambda: plots.lobe(summary, engine)))
        lights = " / ".join(f"{degrees:g}°" for degrees, _ in plots.LIGHTS)
        _caption(
            layout,
            f"Dots: light at {lights}",
            "Across: view from -90° to 90°",
            f"Up: radiance, 0 to {plots.TOP:g} times Lambert's",
            f"Solid: {summary.label}",
            *([f"Dashed: its lobes in {engine.label}"] if engine and summary.lobe_set(engine) else []),
            "Gray: Lambert",
        )


def _plot(layout: bpy.types.UILayout, context: bpy.types.Context, icon: int) -> None:
    unit = 20.0 * context.preferences.system.ui_scale
    width = context.region.width / unit if context.region else WIDEST
    layout.template_icon(icon, scale=max(NARROWEST, min(WIDEST, width - 3.0)))


def _caption(layout: bpy.types.UILayout, *lines: str) -> None:
    column = layout.column(align=True)
    column.scale_y = 0.75
    for line in lines:
        column.label(text=line)


def draw_accuracy(
    layout: bpy.types.UILayout, scene: bpy.types.Scene, material: bpy.types.Material, summary: "MaterialSummary"
) -> None:
    """Draw the stated error of the formulas that `summary` names, and the last measurement of the material's surface."""
    from ..material.summary import mapped_error, material_summary, stated_error

    first, *rest = textwrap.wrap(stated_error(summary, scene) or "Not measured yet", LINE_LENGTH)
    layout.label(text=first, icon="INFO")
    _caption(layout, *rest, *textwrap.wrap(mapped_error(summary, material, scene), LINE_LENGTH))
    layout.operator(TRUE_DIFFUSE_OT_measure.bl_idname)
    measurement = measurements.get(material.session_uid)
    if measurement is None:
        return
    column = layout.column(align=True)
    column.scale_y = 0.85
    if not measurement.is_current(material_summary(material), scene):
        column.label(text="Outdated: other settings", icon="ERROR")
        column.active = False
    for line in measurement.lines():
        column.label(text=line)


def draw_carried(layout: bpy.types.UILayout, context: bpy.types.Context, material: bpy.types.Material) -> None:
    """Draw what of the material Realtime does not draw, and what files of the last check do not carry."""
    from ..probe.exports import fingerprint, realtime_losses

    scene, layer = context.scene, context.view_layer
    unit = scene.unit_settings.scale_length
    _draw_losses(layout, "Realtime", keep(material, layer, ("Realtime", unit), lambda: realtime_losses(material, scene)))
    answer = answers.get(material.session_uid)
    if answer:
        column = layout.column()
        if keep(material, layer, "fingerprint", lambda: fingerprint(material)) != answer.fingerprint:
            column.label(text="Outdated: the material has changed", icon="ERROR")
            column.active = False
        for target, lines in answer.lines.items():
            _draw_losses(column, target, lines)
    layout.operator(TRUE_DIFFUSE_OT_check_exports.bl_idname)


def _draw_losses(layout: bpy.types.UILayout, target: str, lines: Sequence[str] | None) -> None:
    """Draw a line for `target`, and the `lines` of what it does not carry; None where it could not be asked."""
    if lines is None:
        layout.label(text=f"{target}: no exporter in this Blender", icon="INFO")
        return
    layout.label(
        text=f"{target}: {f'{len(lines)} not carried' if lines else 'all is carried'}", icon="ERROR" if lines else "CHECKMARK"
    )
    for line in lines:
        _caption(layout, *textwrap.wrap(line, LINE_LENGTH))


def draw_lights(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw a list of the scene's lights to choose from."""
    from ..nodes import chosen_lights

    chosen = chosen_lights.chosen()
    lights = [item for item in scene.objects if item.type == "LIGHT"]
    layout.label(text=f"{len(chosen)} of up to {chosen_lights.SLOTS} chosen" if lights else "The scene has no light")
    column = layout.column(align=True)
    for light in lights:
        is_chosen = light in chosen
        row = column.row()
        row.enabled = is_chosen or len(chosen) < chosen_lights.SLOTS
        icon = "CHECKBOX_HLT" if is_chosen else "CHECKBOX_DEHLT"
        row.operator(TRUE_DIFFUSE_OT_toggle_light.bl_idname, text=light.name, icon=icon, depress=is_chosen).light = light.name
    for light in chosen:
        if light not in lights:
            column.label(text=f"{light.name} is not in this scene", icon="ERROR")
    if chosen_lights.LIGHTS.trees(linked=True):
        layout.label(text="Linked materials keep their lights", icon="LINKED")
    layout.operator(TRUE_DIFFUSE_OT_use_selected_lights.bl_idname)


def draw_error(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the error to stay below, and the button that picks quality and samples for it."""
    layout.prop(scene.true_diffuse, "error")
    layout.operator(TRUE_DIFFUSE_OT_pick_settings.bl_idname)


register, unregister = bpy.utils.register_classes_factory(
    (TRUE_DIFFUSE_MT_apply, TRUE_DIFFUSE_PT_material, TRUE_DIFFUSE_PT_node, TRUE_DIFFUSE_PT_scene)
)
