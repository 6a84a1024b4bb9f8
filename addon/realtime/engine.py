# SPDX-License-Identifier: GPL-3.0-or-later
"""The class that Blender knows as the render engine True Diffuse Realtime; final.py and viewport.py do its work."""

from typing import TYPE_CHECKING

import bpy

if TYPE_CHECKING:
    from .viewport import Viewport

IDENTIFIER = "TRUE_DIFFUSE_REALTIME"


class TrueDiffuseRealtime(bpy.types.RenderEngine):
    """Draws with the shaders of True Diffuse: every model exact, under every light"""

    bl_idname = IDENTIFIER
    bl_label = "True Diffuse Realtime"
    bl_use_gpu_context = not bpy.app.background  # in final renders, too; without a window `update` asks for it
    bl_use_eevee_viewport = True  # EEVEE draws Material Preview
    bl_use_shading_nodes_custom = False
    bl_use_preview = False

    _viewport: "Viewport | None" = None

    def update(self, _data: bpy.types.BlendData, _depsgraph: bpy.types.Depsgraph) -> None:
        """Have Blender hold a graphics context during `render` where there is a driver. Without one it would crash."""
        from . import final

        if not self.bl_use_gpu_context and final.has_driver():
            self.bl_use_gpu_context = True  # of all renders to come

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render the picture into Combined."""
        from . import final

        final.render(self, depsgraph)

    def update_render_passes(self, scene: bpy.types.Scene, layer: bpy.types.ViewLayer) -> None:
        """Tell the compositor which passes a view layer has."""
        from .passes import asked

        self.register_pass(scene, layer, "Combined", 4, "RGBA", "COLOR")
        if layer.use_pass_z:
            self.register_pass(scene, layer, "Depth", 1, "Z", "VALUE")
        for data in asked(layer):
            self.register_pass(scene, layer, data.name, len(data.channels), data.channels, data.kind)

    def view_update(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Read what changed in the scene."""
        from .viewport import Viewport

        if self._viewport is None:
            self._viewport = Viewport()
        self._viewport.update(self, context, depsgraph)

    def view_draw(self, context: bpy.types.Context, depsgraph: bpy.types.Depsgraph) -> None:
        """Add a sample and draw the picture so far into the window."""
        if self._viewport is not None:
            self._viewport.draw(self, context, depsgraph)
