# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes a scene as USD: its True Diffuse materials as MaterialX networks, each with a UsdPreviewSurface beside it.

uv run scripts/export_usd.py [OPTIONS]
blender -b --python scripts/export_usd.py -- [OPTIONS]
"""

import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.inputs import number
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import load_character, open_scene, run_script, start_blender

if TYPE_CHECKING:
    import bpy

BUILT = ("five", "face")
SUFFIXES = (".usda", ".usdc", ".usdz", ".usd")
RESOLUTION = (1280, 480)  # what the built scenes' cameras are framed for
ALBEDO = 0.8  # of the five characters' lightest paint


def main() -> int:
    """Run the script; returns the exit status."""
    options = parse(script_arguments())
    return run_script("export_usd.py", options.out.parent, partial(export, options), name=options.out.name)


def parse(arguments: list[str]) -> Namespace:
    """Return the options; ends the process with one line and status 2 where they are invalid."""
    parser = Parser(prog="export_usd.py", description=__doc__.splitlines()[0])
    parser.add_argument("--scene", default="five", metavar="WHAT", help="five, face, or a .blend file (default: five)")
    parser.add_argument("--character", default="human", metavar="WHO", help="of five and face, as in compare.py (default: human)")
    parser.add_argument("--material", metavar="NAME", help="only the objects that have this material")
    parser.add_argument(
        "--out", type=_usd_file, default=Path("true_diffuse.usdz"), metavar="FILE", help="default: true_diffuse.usdz"
    )
    text = "bake what USD cannot hold, such as noise, to images of so many pixels a side"
    parser.add_argument("--bake", type=number(int, 1, 16384), metavar="RESOLUTION", help=text)
    options = parser.parse_args(arguments)
    if options.scene not in BUILT and Path(options.scene).suffix != ".blend":
        parser.error(f"unknown scene {options.scene!r}: choose five, face or a .blend file")
    if options.out.is_dir():
        parser.error(f"{options.out} is a folder")
    return options


def _usd_file(text: str) -> Path:
    path = Path(text)
    if path.suffix.lower() not in SUFFIXES or not path.stem:
        raise ArgumentTypeError(f"{text!r} is not a {', '.join(SUFFIXES)} file")
    return path


def export(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Build or open the scene, write it into `output`, then publish it."""
    start_blender(("cycles",), terminal)
    import bpy

    from true_diffuse.addon import usd

    usd.register()
    with terminal.progress(2.0) as progress:
        with progress.step(f"Preparing {options.scene}", 1.0):
            scene = _scene(options, terminal.say)
            exported = _with_material(scene, options.material)
        for item in bpy.context.view_layer.objects:
            item.select_set(item in exported)
        with progress.step(f"Writing {len(exported)} objects", 1.0):
            file = output.folder / options.out.name
            try:
                with _baking(scene, options.bake):
                    bpy.ops.wm.usd_export(filepath=str(file), selected_objects_only=options.material is not None)
            except RuntimeError as error:
                raise BadInput(f"Blender cannot write {options.out}: {' '.join(str(error).split())}") from error
    if not file.is_file():
        raise BadInput(f"Blender cannot write {options.out}")
    for line in usd.report.take():
        terminal.say(line)
    written = _publish_textures(output) + output.publish()
    terminal.say(f"Wrote {', '.join(written)} to {options.out.parent}")


def _baking(scene: "bpy.types.Scene", resolution: int | None) -> AbstractContextManager[None]:
    """Have images of what the networks of the scene's materials lack, where a resolution is given."""
    if resolution is None:
        return nullcontext()
    from true_diffuse.addon.material.materials import materials_of
    from true_diffuse.addon.usd import export as usd_export
    from true_diffuse.addon.usd.baking import baking

    shown = ((material, usd_export.shown(material)) for material in materials_of(scene))
    return baking([(material, target) for material, target in shown if target], usd_export.scale_length(), resolution)


def _scene(options: Namespace, say: Callable[[str], None]) -> "bpy.types.Scene":
    """Return the scene to export, made the window's, which is the one that the exporter writes."""
    import bpy

    if options.scene not in BUILT:
        if not Path(options.scene).is_file():
            raise BadInput(f"there is no file {options.scene}")
        return open_scene(Path(options.scene), say)
    from true_diffuse.scenes import five_characters
    from true_diffuse.scripts.characters import face

    human = options.character == "human"
    mesh = load_character(options.character, say)
    if options.scene == "face":
        scene = face.build(mesh, human, RESOLUTION).scene
    else:
        scene = five_characters.build(mesh, ALBEDO, human, RESOLUTION).scene
    bpy.context.window.scene = scene
    return scene


def _with_material(scene: "bpy.types.Scene", material: str | None) -> list["bpy.types.Object"]:
    """Return the objects with the material of that name, or all for None. Raises BadInput where none has it."""
    if material is None:
        return list(scene.objects)
    exported = [
        item for item in scene.objects if any(slot.material and slot.material.name == material for slot in item.material_slots)
    ]
    if not exported:
        names = sorted({slot.material.name for item in scene.objects for slot in item.material_slots if slot.material})
        raise BadInput(f"no object has the material {material!r}; there are {', '.join(names) or 'none'}")
    return exported


def _publish_textures(output: OutputFolder) -> list[str]:
    """Move the textures to a folder beside the final file, which may hold others; return their names."""
    folder = output.folder / "textures"
    if not folder.is_dir():
        return []
    target = output.target / folder.name
    names = sorted(path.name for path in folder.iterdir())
    try:
        target.mkdir(exist_ok=True)
        for name in names:
            (folder / name).replace(target / name)
    except OSError as error:
        raise BadInput(f"cannot write to {target}: {error.strerror}") from error
    folder.rmdir()
    return [f"{folder.name}/{name}" for name in names]


if __name__ == "__main__":
    end(main())
