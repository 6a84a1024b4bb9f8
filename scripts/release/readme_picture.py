# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the README's picture: a clay head and a dusty face, by Blender's own Diffuse BSDF in EEVEE and by True Diffuse.

uv run scripts/release/readme_picture.py                  writes scripts/manual/difference.webp; a minute
"""

import math
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import load_character, run_script, start_blender

if TYPE_CHECKING:
    import bpy

OUT = Path(__file__).resolve().parents[2] / "scripts" / "manual"
NAME = "difference.webp"
SIZE = (460, 330)  # pixels of one column, which shows both heads
SAMPLES = {"eevee": 32, "cycles": 256}
CLAY, DUST = (0.62, 0.47, 0.36), (0.5, 0.44, 0.38)  # linear albedo
DUSTINESS = 0.55  # fraction of the painted skin's color that dust covers
ROUGHNESS = 1.0
SPACING, HEIGHT = 0.26, 0.36  # m, between the heads, and of what is shown from a little above the crown down
ASIDE = -0.04  # m, of the camera: the heads look to its left
YAW = math.radians(-24.0)
KEY, IRRADIANCE, ANGLE = (-0.42, -1.0, 0.3), 3.4, math.radians(6.0)  # towards the sun; W/m^2; the sun's diameter
SKY = 0.03  # radiance of the surroundings [W/(m^2 sr)]


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="readme_picture.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=OUT, metavar="DIR", help="folder to write (default: scripts/manual)")
    options = parser.parse_args(script_arguments())
    return run_script("readme_picture.py", options.out, partial(draw, options.out))


def draw(out: Path, output: OutputFolder, terminal: Terminal) -> None:
    """Render the columns into `output`, put them side by side and publish the picture."""
    chosen = start_blender(("eevee", "cycles"), terminal)
    import bpy

    from true_diffuse.addon.blender import engines
    from true_diffuse.scripts.studies import pictures

    scene, heads = build(load_character("human"))
    columns = [("Blender's Diffuse BSDF, EEVEE", False, "eevee"), ("True Diffuse, EEVEE", True, "eevee")]
    columns.append(("True Diffuse, Cycles", True, "cycles"))
    with terminal.progress(len(columns)) as progress:
        for index, (label, is_ours, key) in enumerate(columns):
            with progress.step(label, 1.0):
                engine = engines.ENGINES[key]
                if engine not in chosen:
                    raise RuntimeError(f"{engine.label} does not run here")
                for head, paint in heads:
                    head.material_slots[0].material = material(paint, is_ours)
                engines.use(scene, engine, SAMPLES[key])
                scene.render.filepath = str(output.folder / f"{index}.png")
                bpy.ops.render.render(scene=scene.name, write_still=True)
    parts = [output.folder / f"{index}.png" for index in range(len(columns))]
    pictures.strip(parts, output.folder / NAME, [label for label, _, _ in columns])
    for part in parts:
        part.unlink()
    output.publish()
    terminal.say(f"Wrote {NAME}, {(out / NAME).stat().st_size / 1000.0:.0f} kB, to {out}")


def material(paint: str, is_ours: bool) -> "bpy.types.Material":
    """Return a material of `paint`, "clay" or "dust"."""
    from true_diffuse.addon.material import materials
    from true_diffuse.addon.nodes import ROUGH_DIFFUSE
    from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE

    if is_ours:
        made = materials.create(paint, ROUGH_DIFFUSE, Model="Cycles Diffuse", Roughness=ROUGHNESS)
        node = made.node_tree.nodes[ROUGH_DIFFUSE.name]
    else:
        made, node = materials.create_plain(paint)
        node.inputs["Roughness"].default_value = ROUGHNESS
    if paint == "clay":
        node.inputs["Color"].default_value = (*CLAY, 1.0)
    else:
        tree = made.node_tree
        source, mix = tree.nodes.new("ShaderNodeAttribute"), tree.nodes.new("ShaderNodeMix")
        source.attribute_name = ALBEDO_ATTRIBUTE
        mix.data_type = "RGBA"
        factor, skin, dust = (socket for socket in mix.inputs if socket.enabled)
        factor.default_value, dust.default_value = DUSTINESS, (*DUST, 1.0)
        tree.links.new(source.outputs["Color"], skin)
        tree.links.new(next(socket for socket in mix.outputs if socket.enabled), node.inputs["Color"])
    return made


def build(mesh: "bpy.types.Mesh") -> "tuple[bpy.types.Scene, list[tuple[bpy.types.Object, str]]]":
    """Return a scene with two heads of `mesh`, and these with the paint of each."""
    import bpy

    from mathutils import Matrix

    from true_diffuse.addon.blender import color_spaces
    from true_diffuse.scenes.elements import add, add_sun, uniform_world

    scene = bpy.data.scenes.new("Difference")
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    color_spaces.show_plainly(scene)
    scene.render.image_settings.file_format = "PNG"
    top = max(vertex.co.z for vertex in mesh.vertices)
    heads = []
    for side, paint in ((-0.5, "clay"), (0.5, "dust")):
        place = Matrix.Translation((side * SPACING, -side * 0.3, 0.0))
        head = add(scene, paint, mesh, place @ Matrix.Rotation(YAW, 4, "Z"))
        head.material_slots[0].link = "OBJECT"
        heads.append((head, paint))
    add_sun(scene, "Key", KEY, IRRADIANCE, ANGLE)
    camera = bpy.data.cameras.new("Camera")
    camera.type, camera.sensor_fit, camera.ortho_scale = "ORTHO", "VERTICAL", HEIGHT
    camera.clip_start, camera.clip_end = 1.0, 10.0
    place = Matrix.Translation((ASIDE, -5.0, top + 0.02 - HEIGHT / 2))
    scene.camera = add(scene, "Camera", camera, place @ Matrix.Rotation(math.pi / 2, 4, "X"))
    scene.world = uniform_world("Surroundings", (SKY, SKY, SKY))
    return scene, heads


if __name__ == "__main__":
    end(main())
