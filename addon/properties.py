# SPDX-License-Identifier: GPL-3.0-or-later
"""What the extension keeps in a scene."""

import bpy


class TrueDiffuseScene(bpy.types.PropertyGroup):
    """Settings of a scene, as `scene.true_diffuse`."""

    error: bpy.props.FloatProperty(  # ty: ignore[invalid-type-form] - how Blender's properties are declared
        name="Error",
        description="Error to stay below, for which Use Tolerance picks the cheapest mode and samples",
        subtype="PERCENTAGE",
        default=2.0,
        min=0.01,
        max=100.0,
        soft_min=0.1,
        soft_max=20.0,
        precision=2,
    )


_register_class, _unregister_class = bpy.utils.register_classes_factory((TrueDiffuseScene,))


def register() -> None:
    _register_class()
    bpy.types.Scene.true_diffuse = bpy.props.PointerProperty(name="True Diffuse", type=TrueDiffuseScene)


def unregister() -> None:
    del bpy.types.Scene.true_diffuse
    _unregister_class()
