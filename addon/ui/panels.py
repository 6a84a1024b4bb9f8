# SPDX-License-Identifier: GPL-3.0-or-later
"""Panels: Material properties > True Diffuse, the same in the Shader Editor's sidebar, and the error in Scene properties."""

import textwrap
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import bpy

from ..blender.object_types import WITH_FACES
from ..operators.context import is_node_editor, material_of, node_of
from ..operators.convert import TRUE_DIFFUSE_OT_convert, TRUE_DIFFUSE_OT_convert_nodes
from ..operators.exports import TRUE_DIFFUSE_OT_check_exports, answers
from ..operators.lights import TRUE_DIFFUSE_OT_toggle_light, TRUE_DIFFUSE_OT_use_selected_lights
from ..operators.measure import TRUE_DIFFUSE_OT_measure, measurements
from ..operators.steps import running
from ..operators.tolerance import TRUE_DIFFUSE_OT_pick_settings, picked, report_path
from ..operators.upgrade import TRUE_DIFFUSE_OT_upgrade
from . import menus, plots
from .kept import keep

if TYPE_CHECKING:
    from ..material.summary import MaterialSummary

LINE_LENGTH = 34  # letters that fit into a sidebar beside an icon
NARROWEST, WIDEST = 7.0, 13.0  # of a plot, times an icon's size


class TRUE_DIFFUSE_PT_material(bpy.types.Panel):
    """The presets for the material, and its accuracy"""

    bl_label = "True Diffuse"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "material"
    bl_options = {"HIDE_HEADER"}  # so Blender draws it above panels with a header, right below the material slots

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        material = material_of(context)
        if material is not None:
            return not material.is_grease_pencil
        return context.object is not None and context.object.type in WITH_FACES

    def draw(self, context: bpy.types.Context) -> None:
        header, body = self.layout.panel("true_diffuse")
        header.label(text=self.bl_label)
        if body:
            draw_material(body, context, default_closed=True)


class TRUE_DIFFUSE_PT_node(bpy.types.Panel):
    """The presets and the accuracy of the active True Diffuse node, else of the material's surface"""

    bl_label = "True Diffuse"
    bl_space_type = "NODE_EDITOR"
    bl_region_type = "UI"
    bl_category = "True Diffuse"

    @classmethod
    def poll(cls, context: bpy.types.Context) -> bool:
        return context.space_data.tree_type == "ShaderNodeTree" and material_of(context) is not None

    def draw(self, context: bpy.types.Context) -> None:
        draw_material(self.layout, context)


class TRUE_DIFFUSE_PT_scene(bpy.types.Panel):
    """The error that quality and samples are picked for"""

    bl_label = "True Diffuse"
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "scene"

    def draw(self, context: bpy.types.Context) -> None:
        self.layout.use_property_split, self.layout.use_property_decorate = True, False
        draw_error(self.layout, context.scene)


def draw_material(layout: bpy.types.UILayout, context: bpy.types.Context, default_closed: bool = False) -> None:
    """Draw the panel of the editor's material; the sections below the presets are closed at first where `default_closed`."""
    from ..material.summary import node_summary

    layout.use_property_split, layout.use_property_decorate = True, False
    material, node = material_of(context), node_of(context)
    if material is not None and material.override_library is not None:
        layout.label(text="Library override: its nodes cannot be changed", icon="LIBRARY_DATA_OVERRIDE")
    elif material is not None and not material.is_editable:
        layout.label(text="Linked from another file", icon="LINKED")
    summary = node_summary(node) if node else None
    draw_presets(layout, context, node, is_current=summary is not None)
    if material is None or summary is None:
        return

    def section(key: str, title: str, draw: Callable[[bpy.types.UILayout], None], is_closed: bool = default_closed) -> None:
        header, body = layout.panel(f"true_diffuse_{key}", default_closed=is_closed)
        header.label(text=title)
        if body:
            draw(body)

    if summary.follows_lights:
        section("lights", "Lights", lambda body: draw_lights(body, context, node, summary), False)
    section("plot", "Plot", lambda body: draw_plots(body, context, summary))
    section("accuracy", "Accuracy", lambda body: draw_accuracy(body, context.scene, material, summary))
    section("carried", "Not Carried", lambda body: draw_carried(body, context, material))
    section("error", "Error", lambda body: draw_error(body, context.scene))


def draw_presets(layout: bpy.types.UILayout, context: bpy.types.Context, node: bpy.types.Node | None, is_current: bool) -> None:
    """Draw what opens the gallery of presets: the picture of the one that `node` has; and what else can be done with the node.

    `is_current`: whether there is a node, which holds a group of this version.
    """
    from ..material.apply_preset import preset_of

    preset = preset_of(node) if node and is_current else None
    split = layout.split(factor=min(0.5, (menus.PICTURE_SIZE + 0.2) / (_width(context) - 2.0)))
    card = split.column(align=True)
    menus.behind_picture(card).popover(menus.TRUE_DIFFUSE_PT_gallery.__name__, text="")
    card.template_icon(menus.picture(preset), scale=menus.PICTURE_SIZE)
    column = split.column()
    column.popover(menus.TRUE_DIFFUSE_PT_gallery.__name__, text=preset.name if preset else "Presets")
    if preset:
        column.label(text=preset.kind)
    elif node is not None and not is_current:
        column.label(text="Another version", icon="ERROR")
        column.operator(TRUE_DIFFUSE_OT_upgrade.bl_idname)
    elif node is None and material_of(context) is not None:
        operator = TRUE_DIFFUSE_OT_convert_nodes if is_node_editor(context) else TRUE_DIFFUSE_OT_convert
        column.operator(operator.bl_idname)


def draw_plots(layout: bpy.types.UILayout, context: bpy.types.Context, summary: "MaterialSummary") -> None:
    """Draw the lobe, and the profile below the surface where there is one, with a legend and captions of the axes."""
    from ..material.summary import engine_of
    from ..nodes import SUBSURFACE

    engine = engine_of(context.scene)
    key = (summary.group, *sorted((name, value) for name, value in summary.inputs.items() if name != "Normal"))
    is_subsurface = summary.group == SUBSURFACE.key
    if is_subsurface and summary.number("Subsurface") > 0.0:
        _plot(layout, context, plots.icon(("profile", key), lambda: plots.profile(summary)))
        _legend(layout.row(), [(plots.swatch(color), channel) for channel, color in plots.CHANNELS.items()])
        _caption(
            layout,
            "Light by distance from its entry",
            f"Across: 0 to {plots.profile_reach(summary):.3g} mm",
            f"Up: R(r) [1/mm²], {plots.DECADES} decades",
        )
    if not is_subsurface or summary.number("Subsurface") < 1.0:
        _plot(layout, context, plots.icon(("lobe", engine and engine.key, key), lambda: plots.lobe(summary, engine)))
        _legend(layout.row(), [(plots.swatch(color, "dot"), f"{degrees:g}°") for degrees, color in plots.LIGHTS])
        lines = {"Lambert": plots.swatch(plots.IDEAL), summary.label: plots.swatch(plots.MODEL)}
        if engine and summary.lobe_set(engine):
            lines[f"Lobes in {engine.label}"] = plots.swatch(plots.dimmed(plots.MODEL), "dashes")
        _legend(layout.column(align=True), [(icon, text) for text, icon in lines.items()])
        _caption(layout, "Dots: angle of the light", "Across: view from -90° to 90°", f"Up: 0 to {plots.TOP:g} times Lambert's")


def _plot(layout: bpy.types.UILayout, context: bpy.types.Context, icon: int) -> None:
    layout.template_icon(icon, scale=max(NARROWEST, min(WIDEST, _width(context) - 3.0)))


def _width(context: bpy.types.Context) -> float:
    """Return the width of the editor's region, times an icon's size."""
    unit = 20.0 * context.preferences.system.ui_scale
    return context.region.width / unit if context.region else WIDEST


def _legend(layout: bpy.types.UILayout, entries: Sequence[tuple[int, str]]) -> None:
    """Draw what each icon of a plot stands for."""
    layout.alignment = "LEFT"  # else labels in a row share its width equally, whether they need it or not
    for icon, text in entries:
        layout.label(text=text, icon_value=icon)


def _wrap(text: str) -> list[str]:
    """Return `text` in lines that fit into a sidebar."""
    return textwrap.wrap(text, LINE_LENGTH, break_on_hyphens=False)


def _caption(layout: bpy.types.UILayout, *lines: str) -> None:
    column = layout.column(align=True)
    column.scale_y = 0.75
    for line in lines:
        column.label(text=line)


def draw_accuracy(
    layout: bpy.types.UILayout, scene: bpy.types.Scene, material: bpy.types.Material, summary: "MaterialSummary"
) -> None:
    """Draw the stated error of the formulas that `summary` names, and the last measurement of the material's surface."""
    from ..material.summary import mapped_error, material_summary, stated_error, thickness_message

    first, *rest = _wrap(stated_error(summary, scene) or "Not measured yet")
    layout.label(text=first, icon="INFO")
    notes = mapped_error(summary, material, scene), thickness_message(summary, material, scene)
    _caption(layout, *rest, *(line for note in notes for line in _wrap(note)))
    layout.operator(TRUE_DIFFUSE_OT_measure.bl_idname)
    _draw_running(layout, TRUE_DIFFUSE_OT_measure)
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
    _caption(layout, *_wrap(measurement.meaning))


def _draw_running(layout: bpy.types.UILayout, operator: type[bpy.types.Operator]) -> None:
    """Draw how far `operator` is with its steps, if it runs."""
    for work in running:
        if work.operator is operator:
            layout.progress(factor=work.fraction, text=f"{100.0 * work.fraction:.0f} %, Esc cancels")


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
        _caption(layout, *_wrap(line))


def draw_lights(layout: bpy.types.UILayout, context: bpy.types.Context, node: bpy.types.Node, summary: "MaterialSummary") -> None:
    """Draw the lights that the node follows among those of the scene, to choose from; of a linked node just what it follows."""
    from ..blender.engines import REALTIME
    from ..material.summary import engine_of, without_lights
    from ..nodes import chosen_lights

    chosen, lights = summary.lights, [item for item in context.scene.objects if item.type == "LIGHT"]
    tree = chosen_lights.tree_inside(node.node_tree)
    is_linked = tree is not None and tree.library is not None
    if not chosen:
        is_needless = engine_of(context.scene) is REALTIME
        layout.label(text="No light is chosen", icon="INFO" if is_needless else "ERROR")
        text = without_lights(summary)
        _caption(layout, f"{text[0].upper()}{text[1:]}", *(["in EEVEE and Cycles"] if is_needless else []))
    elif not is_linked:
        layout.label(text=f"{len(chosen)} of up to {chosen_lights.SLOTS} chosen")
    column = layout.column(align=True)
    for light in () if is_linked else lights:
        is_chosen = light in chosen
        row = column.row()
        row.enabled = is_chosen or len(chosen) < chosen_lights.SLOTS
        icon = "CHECKBOX_HLT" if is_chosen else "CHECKBOX_DEHLT"
        row.operator(TRUE_DIFFUSE_OT_toggle_light.bl_idname, text=light.name, icon=icon, depress=is_chosen).light = light.name
    for light in chosen:
        if light not in lights:
            column.label(text=f"{light.name} is not in this scene", icon="ERROR")
        elif light.hide_render or not light.visible_get():
            column.label(text=f"{light.name} is hidden in {'renders' if light.hide_render else 'the viewport'}", icon="INFO")
        elif is_linked:
            column.label(text=light.name, icon="LIGHT")
    if is_linked:
        layout.label(text=f"Chosen in {bpy.path.basename(tree.library.filepath)}", icon="LINKED")
        return
    if chosen:
        _caption(layout, "Other light counts as from these")
    if not lights:
        layout.label(text="The scene has no light", icon="INFO")
    layout.operator(TRUE_DIFFUSE_OT_use_selected_lights.bl_idname)


def draw_error(layout: bpy.types.UILayout, scene: bpy.types.Scene) -> None:
    """Draw the error to stay below, and the button that picks quality and samples for it."""
    from ..probe import benchmark
    from ..probe.measurement import MeasurementError, RenderSetup

    layout.prop(scene.true_diffuse, "error")
    layout.operator(TRUE_DIFFUSE_OT_pick_settings.bl_idname)
    _draw_running(layout, TRUE_DIFFUSE_OT_pick_settings)
    now = picked.get(scene.session_uid)
    if now:
        try:
            is_current = (now.error, now.setup) == (scene.true_diffuse.error, RenderSetup.of(scene))
        except MeasurementError:
            is_current = False
        column = layout.column(align=True)
        column.scale_y = 0.85
        if not is_current:
            column.label(text="Outdated: other settings", icon="ERROR")
            column.active = False
        for line in now.lines:
            column.label(text=line)
    report = report_path()
    _caption(layout, *_wrap(f"By the report {report.name}" if report else benchmark.source()))


register, unregister = bpy.utils.register_classes_factory((TRUE_DIFFUSE_PT_material, TRUE_DIFFUSE_PT_node, TRUE_DIFFUSE_PT_scene))
