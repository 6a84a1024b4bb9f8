# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a USD stage with Hydra Storm, OpenUSD's own rasterizer, as Blender's copy of OpenUSD has it. Needs a graphics driver."""

from array import array
from contextlib import suppress
from typing import TYPE_CHECKING

import bpy

import gpu

if TYPE_CHECKING:
    from pxr import Usd, UsdGeom


def radiance(stage: "Usd.Stage", camera: "UsdGeom.Camera", size: int) -> array[float]:
    """Return linear RGB [W/(m^2 sr)] of every pixel of a square picture as `camera` sees it, rows from the top.

    Within a pixel of an edge Storm mixes what is on either side. It takes a distant light's intensity for E0 on a plane that faces
    it [W/m^2], and an orthographic camera for a perspective one where shading needs the viewer.
    """
    from pxr import CameraUtil, Gf, Tf, UsdImagingGL

    if bpy.app.background:
        gpu.init()
    target = gpu.types.GPUOffScreen(size, size, format="RGBA32F")
    with target.bind():
        framebuffer = gpu.state.active_framebuffer_get()
        framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
        engine = UsdImagingGL.Engine()
        engine.SetRendererAov("color")
        engine.SetRenderBufferSize(Gf.Vec2i(size, size))
        window = Gf.Range2f(Gf.Vec2f(0.0, 0.0), Gf.Vec2f(size, size))
        engine.SetFraming(CameraUtil.Framing(window, Gf.Rect2i(Gf.Vec2i(0, 0), size, size)))
        frustum = camera.GetCamera().frustum
        engine.SetCameraState(frustum.ComputeViewMatrix(), frustum.ComputeProjectionMatrix())
        parameters = UsdImagingGL.RenderParams()
        parameters.colorCorrectionMode = "disabled"
        parameters.clearColor = Gf.Vec4f(0.0, 0.0, 0.0, 0.0)
        parameters.enableSampleAlphaToCoverage = False
        with suppress(Tf.ErrorException):  # it complains of a GL error that others in this context left behind, having rendered
            engine.Render(stage.GetPseudoRoot(), parameters)
        rows = framebuffer.read_color(0, 0, size, size, 4, 0, "FLOAT").to_list()
        del engine  # while its context is the current one
    target.free()
    return array("f", (value for row in reversed(rows) for pixel in row for value in pixel[:3]))
