# SPDX-License-Identifier: GPL-3.0-or-later
"""Hair of particle systems, read as the control points of curves."""

from array import array
from collections.abc import Iterator

import bpy

from .strips import Strips


def hair_systems(item: bpy.types.Object, is_render: bool) -> Iterator[bpy.types.ParticleSystem]:
    """Yield the particle systems of an evaluated object whose hair is drawn as paths, in a render or in a viewport."""
    for modifier in item.modifiers if item.particle_systems else ():
        if modifier.type != "PARTICLE_SYSTEM" or not (modifier.show_render if is_render else modifier.show_viewport):
            continue
        settings = modifier.particle_system.settings
        if settings.type == "HAIR" and settings.render_type == "PATH":
            yield modifier.particle_system


def hair_strips(item: bpy.types.Object, system: bpy.types.ParticleSystem, is_render: bool) -> Strips:
    """Return the strips of a particle system's hair in the space of `item`; children stand for their parents, as in Cycles."""
    settings = system.settings
    parents, children = len(system.particles), len(system.child_particles)
    if not is_render:
        children = children * settings.display_percentage // 100
    first = parents if settings.child_type != "NONE" and children else 0
    steps = 2 ** (settings.render_step if is_render else settings.display_step) + 1
    if settings.kink == "SPIRAL":
        steps += settings.kink_extra_steps
    to_object = item.matrix_world.inverted_safe()
    root, tip = (radius * settings.radius_scale / 2.0 for radius in (settings.root_radius, settings.tip_radius))
    thickness = [_shape(step / (steps - 1), settings.shape) * (root - tip) + tip for step in range(steps)]
    if settings.use_close_tip:
        thickness[-1] = 0.0
    offsets, positions, radii = array("i", (0,)), array("f"), array("f")
    for particle in range(first, parents + children):
        points = [system.co_hair(object=item, particle_no=particle, step=step) for step in range(steps)]
        kept = [step for step, point in enumerate(points) if not step or point != points[step - 1]]
        for step in kept:
            positions.extend(to_object @ points[step])
            radii.append(thickness[step])
        offsets.append(len(radii))
    return Strips(offsets, positions, radii)


def hair_material(item: bpy.types.Object, system: bpy.types.ParticleSystem) -> bpy.types.Material | None:
    """Return the material of a particle system's hair: that of the slot it names, or the last."""
    slots = item.material_slots
    return slots[min(system.settings.material, len(slots)) - 1].material if slots else None


def _shape(time: float, shape: float) -> float:
    """Return how much of the radius between tip and root is left at a place from root to tip, 0 to 1."""
    return (1.0 - time) ** (1.0 + shape if shape < 0.0 else 1.0 / max(1.0 - shape, 1e-6))
