# SPDX-License-Identifier: GPL-3.0-or-later
"""What every script does around its own work: options of the same kind, errors, an empty Blender, the engines that run here."""

import tempfile
import traceback
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from true_diffuse.scripts.cli import process
from true_diffuse.scripts.cli.console import BadInput, Terminal, say_error, say_stopped
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.studies.comparison.outcomes import WorkError
from true_diffuse.scripts.web import WebError

if TYPE_CHECKING:
    from bpy.types import Mesh, Scene

    from true_diffuse.addon.blender.engines import Engine

ENGINE_KEYS = ("eevee", "cycles", "realtime")
# Where compiling shaders is measured, the driver must not know them from an earlier run.
NO_SHADER_CACHE = {"MESA_SHADER_CACHE_DISABLE": "true", "__GL_SHADER_DISK_CACHE": "0"}
NODE_ENGINES = ("eevee", "cycles")  # that render what the groups' nodes say


def run_script(
    prog: str, folder: Path, work: Callable[[OutputFolder, Terminal], None], left: str = "nothing written", name: str = ""
) -> int:
    """Do `work` in a process of its own, its files staged for `folder`; return the exit status, having said what went wrong if so.

    `left` is what an interrupt leaves, in words. `name` is of the one file that is written to the folder, where it is one.
    """
    room = process.room()
    try:
        with OutputFolder(folder, name, room) as output:
            if room is None:
                ended = process.again(output.folder.parent)
                if isinstance(ended, int):
                    return ended
                raise BadInput(ended)
            with Terminal() as terminal:
                work(output, terminal)
    except process.Stopped as stopped:
        return say_stopped(prog, left, stopped.number)
    except (BadInput, WebError, WorkError) as error:
        return say_error(prog, str(error))
    except OSError as error:  # of the disk or a file, not of the code
        where = error.filename or f"{folder} or {tempfile.gettempdir()}"
        return say_error(prog, f"{error.strerror or error}: {where}")
    except Exception:
        traceback.print_exc()  # as Blender does, but its own exit status would be 0
        return 1
    return 0


def empty_file() -> None:
    """Start from a file with nothing in it, and the scene's settings as Blender has them."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)


def load_character(who: str, say: Callable[[str], None] = print) -> "Mesh":
    """Return the mesh of a character, once Blender is started; raises BadInput where it cannot be had.

    `say` is told in a line what of a file is not shown.
    """
    from true_diffuse.scripts.characters import character

    try:
        return character.load(who, say)
    except character.CharacterError as error:
        raise BadInput(str(error)) from error


def open_scene(path: Path, say: Callable[[str], None]) -> "Scene":
    """Open a .blend file, and return the scene to show of it, in the window; raises BadInput where that fails.

    Scripts in it do not run. `say` is told in a line what is missing that nothing shown needs, and which of several scenes it is.
    """
    from true_diffuse.scripts.characters import character

    try:
        return character.open_blend(path, say)
    except character.CharacterError as error:
        raise BadInput(str(error)) from error


def load_bpy() -> None:
    """Load Blender's module; raises BadInput where that fails."""
    try:
        import bpy  # noqa: F401 - where that fails, it is said in one line
    except ImportError as error:
        raise BadInput(f"Blender's module cannot be loaded: {error}") from error


def start_blender(keys: Sequence[str], terminal: Terminal) -> list["Engine"]:
    """Load an empty file, and return the engines of `keys` that run here.

    Raises BadInput where Blender cannot read its renders, or no engine is left.
    """
    terminal.say("Loading Blender")
    load_bpy()
    from true_diffuse.addon.blender import engines
    from true_diffuse.addon.measure import render

    try:
        render.openimageio()
    except ImportError:
        raise BadInput("this Blender lacks OpenImageIO, which reads the renders (Debian: python3-openimageio)") from None
    empty_file()
    chosen = [engines.ENGINES[key] for key in keys]
    drawing = [engine for engine in chosen if engine is not engines.CYCLES]
    if drawing and not engines.eevee_runs_here():
        for engine in drawing:
            terminal.say(f"{engine.label} finds no graphics driver here and is left out")
            chosen.remove(engine)
    if not chosen:
        raise BadInput("no engine is left to render with")
    if engines.REALTIME in chosen:
        register_realtime()
    return chosen


@cache
def register_properties() -> None:
    """Give scenes the extension's settings, once: they stay where a file is emptied, as an extension that was enabled does not."""
    from true_diffuse.addon.blender import properties

    properties.register()


@cache
def register_realtime() -> None:
    """Make Realtime known to Blender, which has the other two, once."""
    from true_diffuse.addon import realtime

    register_properties()
    realtime.register()
