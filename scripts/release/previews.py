# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the previews of presets and groups in the menus and the asset library, with Cycles on the CPU.

uv run scripts/release/previews.py [OPTIONS]
blender -b --python scripts/release/previews.py -- [OPTIONS]
"""

import math
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.inputs import sample_count
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import run_script, start_blender

if TYPE_CHECKING:
    import bpy

PICTURES = Path(__file__).resolve().parents[2] / "addon" / "previews"
SIZE = 128  # pixels: what the Asset Browser keeps
QUALITY = 55  # of WebP, in percent: some 1 kB each
HEIGHT = 0.03  # m, of a monkey: its ears are 2 mm thick, so that millimetres show
VOXEL = 0.012  # heights
# Position [heights from the middle], size [heights], radiance of a white surface in the middle facing it
LIGHTS = (
    ((-1.6, -2.2, 1.8), 1.5, 0.9),  # key: soft, from the left
    ((1.2, 1.7, 0.9), 0.8, 3.5),  # from behind, through the ear
)
WORLD = 0.15


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="previews.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--samples", type=sample_count, default=256, metavar="N", help="samples per pixel (default: 256)")
    parser.add_argument("--out", type=Path, default=PICTURES, metavar="DIR", help="folder to write (default: addon/previews)")
    options = parser.parse_args(script_arguments())
    return run_script("previews.py", options.out, partial(previews, options.samples, options.out))


def previews(samples: int, out: Path, output: OutputFolder, terminal: Terminal) -> None:
    """Render a picture of every preset and group into `output`, then publish them."""
    start_blender(("cycles",), terminal)
    import bpy

    from true_diffuse.addon.blender import engines
    from true_diffuse.addon.material import materials
    from true_diffuse.addon.material.presets import EXAMPLES, PRESETS, picture
    from true_diffuse.addon.nodes import GROUPS

    scene = bpy.context.scene
    subject = build(scene)
    engines.use(scene, engines.CYCLES, samples)
    scene.cycles.use_denoising = True
    subjects = [
        *((preset.key, preset.group, preset.inputs) for preset in PRESETS.values()),
        *((group.key, group, EXAMPLES.get(group.key, {})) for group in GROUPS),
    ]
    with terminal.progress(len(subjects)) as progress:
        for key, group, inputs in subjects:
            with progress.step(key, 1.0):
                subject.active_material = materials.create(key, group, **inputs)
                scene.render.filepath = str(output.folder / picture(key).name)
                bpy.ops.render.render(write_still=True)
    written = output.publish()
    size = sum((out / name).stat().st_size for name in written)
    terminal.say(f"Wrote {len(written)} pictures, {size / 1000.0:.0f} kB, to {out}")


def build(scene: "bpy.types.Scene") -> "bpy.types.Object":
    """Set up `scene` for the pictures; return the object that takes the material."""
    import bpy

    from mathutils import Matrix, Vector

    from true_diffuse.scenes.elements import towards, uniform_world
    from true_diffuse.scenes.subject import HEIGHT as UPRIGHT
    from true_diffuse.scripts.characters import character

    subject = bpy.data.objects.new("Subject", character.load("monkey"))
    subject.scale = (HEIGHT / UPRIGHT,) * 3
    subject.rotation_euler.z = math.radians(-25.0)
    # One closed surface; else light would hit the eyeballs inside the head.
    remesh = subject.modifiers.new("Remesh", "REMESH")
    remesh.voxel_size, remesh.use_smooth_shade = VOXEL * UPRIGHT, True
    scene.collection.objects.link(subject)
    middle = HEIGHT * Vector((0.09, 0.0, 0.5))

    def place(item: bpy.types.Object, offset: tuple[float, float, float]) -> None:
        away = HEIGHT * Vector(offset)
        item.matrix_world = Matrix.Translation(middle + away) @ towards(away)
        scene.collection.objects.link(item)

    for offset, size, irradiance in LIGHTS:
        light = bpy.data.lights.new("Light", "AREA")
        light.shape, light.size = "DISK", size * HEIGHT
        # at a distance d, an area light of P watts gives an irradiance of P / (pi d^2)
        light.energy = irradiance * math.pi * math.pi * (HEIGHT * Vector(offset).length) ** 2
        place(bpy.data.objects.new("Light", light), offset)
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 1.36 * HEIGHT
    camera.data.clip_start = 0.1 * HEIGHT
    place(camera, (0.0, -5.0, 0.5))
    scene.camera = camera
    scene.world = uniform_world("World", (WORLD, WORLD, WORLD))
    scene.render.film_transparent = True
    scene.render.resolution_x = scene.render.resolution_y = SIZE
    scene.render.dither_intensity = 0.0  # small files
    for name in dir(scene.render):
        if name.startswith("use_stamp_"):  # date, times and paths, which a PNG holds, too
            setattr(scene.render, name, False)
    scene.render.image_settings.file_format = "WEBP"
    scene.render.image_settings.color_mode = (
        "RGB"  # on black: alpha, which WebP stores losslessly, would be larger than the picture
    )
    scene.render.image_settings.quality = QUALITY
    scene.view_settings.view_transform = "Khronos PBR Neutral"  # of Blender's own configuration
    return subject


if __name__ == "__main__":
    end(main())
