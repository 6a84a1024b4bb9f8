# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engines: their names in Blender, whether they run here, and their settings for a given number of samples."""

import os
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import bpy

QUIET = 0.5  # seconds: far longer than Cycles is between two of its calls of Python
PROBE_SECONDS = 120  # a cold start of Blender on a slow disk; usually about two


@dataclass(frozen=True)
class Engine:
    """A render engine. `key` names it in scripts and files, `identifier` in Blender, `label` to people."""

    key: str
    label: str
    identifier: str
    apply: Callable[[bpy.types.Scene, int], None]


def _apply_eevee(scene: bpy.types.Scene, samples: int) -> None:
    scene.eevee.taa_render_samples = samples
    # The vertex normals' default, 10 bits a component, shows as steps in smooth shading.
    scene.render.use_high_quality_normals = True


def _apply_cycles(scene: bpy.types.Scene, samples: int) -> None:
    scene.cycles.device = "CPU"
    scene.cycles.samples = samples
    scene.cycles.use_adaptive_sampling = False
    scene.cycles.use_denoising = False


def _apply_realtime(scene: bpy.types.Scene, samples: int) -> None:
    scene.true_diffuse.samples = samples


EEVEE = Engine("eevee", "EEVEE", "BLENDER_EEVEE", _apply_eevee)
CYCLES = Engine("cycles", "Cycles", "CYCLES", _apply_cycles)
REALTIME = Engine("realtime", "Realtime", "TRUE_DIFFUSE_REALTIME", _apply_realtime)
ENGINES = {engine.key: engine for engine in (EEVEE, CYCLES, REALTIME)}


def use(scene: bpy.types.Scene, engine: Engine, samples: int, seed: int = 0) -> None:
    """Make `scene` render with `engine` and `samples` per pixel, without denoising, reproducibly.

    `seed` chooses Cycles' random numbers; EEVEE has none to choose (see `measure.render.radiance`), Realtime has none at all.
    Raises AttributeError for Realtime where neither the extension nor a script has registered it.
    """
    choose(scene, engine.identifier)
    engine.apply(scene, samples)
    scene.cycles.seed = seed


def leave_out_bounces(scene: bpy.types.Scene) -> None:
    """Have Cycles and, where it is registered, Realtime render `scene` without light that comes from other surfaces."""
    scene.cycles.max_bounces = 0
    if settings := getattr(scene, "true_diffuse", None):
        settings.bounces_light = False


def choose(scene: bpy.types.Scene, identifier: str) -> None:
    """Make `scene` render with the engine of that `identifier`, once Cycles has ended the material preview that it is at.

    Blender 5.2 hangs otherwise: it waits for the preview's thread, which waits for Python, which the script holds. As Blender calls
    the preview a running job until its event loop goes on, one counts as ended where Cycles has run no Python for QUIET seconds.
    """
    if scene.render.engine == identifier:
        return
    now = last = time.monotonic()
    while bpy.app.is_job_running("RENDER_PREVIEW") and now - last < QUIET:
        time.sleep(0.01)  # other threads get Python
        now = time.monotonic()
        if any(f"{os.sep}cycles{os.sep}" in frame.f_code.co_filename for frame in sys._current_frames().values()):
            last = now
    scene.render.engine = identifier


def uses_osl(scene: bpy.types.Scene) -> bool:
    """Return whether the groups take `scene` to render with Open Shading Language: as the driver of `Graph.uses_osl`."""
    cycles = getattr(scene, "cycles", None)  # Blender without Cycles
    osl = cycles is not None and cycles.shading_system and cycles.device == "CPU"
    return scene.render.engine != EEVEE.identifier and osl


def device(engine: Engine) -> str:
    """Return what `engine` computes on: the name of the graphics driver's device, or "CPU"."""
    if engine is CYCLES:
        return "CPU"
    import gpu

    if bpy.app.background:
        gpu.init()
    return gpu.platform.renderer_get()


def another_blender(code: str) -> list[str]:
    """Return the command that runs `code` in another Blender with factory settings; its exit status is not 0 where that fails."""
    binary = bpy.app.binary_path
    if not binary:  # Blender as a Python module
        return [sys.executable, "-c", code]
    return [binary, "--background", "--factory-startup", "--python-exit-code", "1", "--python-expr", code]


def eevee_runs_here() -> bool:
    """Return whether EEVEE, and with it Realtime, finds a graphics driver.

    Blender's process ends with a crash where there is none, so another process tries.
    """
    code = "import bpy, gpu; gpu.init(); gpu.platform.renderer_get()"
    try:
        return subprocess.run(another_blender(code), capture_output=True, timeout=PROBE_SECONDS, check=False).returncode == 0
    except subprocess.TimeoutExpired:
        return False
