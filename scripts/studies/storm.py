# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders a USD stage with Hydra Storm, the rasterizer in Blender's copy of OpenUSD. Needs a graphics driver."""

from array import array
from contextlib import suppress
from typing import TYPE_CHECKING

import bpy

import gpu

if TYPE_CHECKING:
    from pxr import Usd, UsdGeom


def radiance(stage: "Usd.Stage", camera: "UsdGeom.Camera", size: int) -> array[float]:
    """Return the linear RGB radiance [W/(m^2 sr)] of a square picture of `size` pixels from `camera`, rows from the top.

    Storm blends both sides of an edge within a pixel, takes a distant light's intensity for its irradiance [W/m^2] on a plane
    facing it, and treats an orthographic camera as a perspective one where shading needs the viewer.
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
        with suppress(Tf.ErrorException):  # it reports GL errors that others left in this context, after rendering
            engine.Render(stage.GetPseudoRoot(), parameters)
        rows = framebuffer.read_color(0, 0, size, size, 4, 0, "FLOAT").to_list()
        del engine  # while its context is current
    target.free()
    return array("f", (value for row in reversed(rows) for pixel in row for value in pixel[:3]))
