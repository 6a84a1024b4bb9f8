# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties that the extension adds to scenes."""

import bpy

SAMPLES = {"min": 1, "soft_max": 256}


class TrueDiffuseScene(bpy.types.PropertyGroup):
    """Settings of a scene, as `scene.true_diffuse`."""

    error: bpy.props.FloatProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Error",
        description="Error to stay below, for which Pick Settings for Error finds the fastest quality and samples",
        subtype="PERCENTAGE",
        default=2.0,
        min=0.01,
        max=100.0,
        soft_min=0.1,
        soft_max=20.0,
        precision=2,
    )
    samples: bpy.props.IntProperty(  # ty: ignore[invalid-type-form]
        name="Render Samples",
        description="Samples per pixel of True Diffuse Realtime in final renders",
        default=64,  # so that soft shadows and bounced light are smooth
        **SAMPLES,
    )
    viewport_samples: bpy.props.IntProperty(  # ty: ignore[invalid-type-form]
        name="Viewport Samples",
        description="Samples per pixel of True Diffuse Realtime in the viewport, one per redraw",
        default=32,
        **SAMPLES,
    )
    bounces_light: bpy.props.BoolProperty(  # ty: ignore[invalid-type-form]
        name="Bounce Light",
        description="Light that other surfaces reflect once, and shade where they hide the sky, in True Diffuse Realtime. "
        "It takes several times as long for each sample, and 64 samples and more until it is smooth",
        default=False,
    )
    bake: bpy.props.BoolProperty(  # ty: ignore[invalid-type-form]
        name="Bake What Cannot Be Carried",
        description="Bake nodes that the file cannot hold, with Cycles, to images on the UV map of the meshes. "
        "Without it the file gets a simpler value, and a message says so",
        default=False,
    )
    bake_resolution: bpy.props.IntProperty(  # ty: ignore[invalid-type-form]
        name="Resolution",
        description="Width and height of baked images",
        subtype="PIXEL",
        default=1024,
        min=16,
        max=16384,
        soft_max=8192,
    )


_register_class, _unregister_class = bpy.utils.register_classes_factory((TrueDiffuseScene,))


def register() -> None:
    _register_class()
    bpy.types.Scene.true_diffuse = bpy.props.PointerProperty(name="True Diffuse", type=TrueDiffuseScene)


def unregister() -> None:
    del bpy.types.Scene.true_diffuse
    _unregister_class()
