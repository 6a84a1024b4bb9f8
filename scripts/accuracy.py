# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how near each target of each model comes to its formula, and writes records of it.

uv run scripts/accuracy.py --only rough --out accuracy.json
"""

import json
import subprocess
import sys
import tempfile
from argparse import Namespace
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, script_arguments
from true_diffuse.scripts.cli.inputs import sample_count
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import (
    NODE_ENGINES,
    empty_file,
    engine_list,
    load_character,
    register_realtime,
    run_script,
    start_blender,
)

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.addon.measure.record import Progress, Record

SIZE = 96  # pixels across the sphere: 5000 to compare
BOTH_SIZE = 64  # where the engines are held against each other, as Cycles needs many samples

type Measure = Callable[[Namespace, list["Engine"], Terminal], list["Record"]]
type Table = tuple[tuple[str, ...], list[tuple[str, ...]]]


def show(
    terminal: Terminal,
    work: float,
    measure: Callable[["Progress"], Iterable["Record"]],
    title: str,
    table: Callable[[Sequence["Record"]], Table],
) -> list["Record"]:
    """Return the records of `measure`, having shown how far its `work` is and then the table of them."""
    with terminal.progress(work) as progress:
        records = list(measure(progress))
    terminal.table(title, *table(records))
    return records


def rough(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold each rough model, target and quality against its formula, on a sphere under a sun."""
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import rough as study

    work, sphere = study.rough_work(engines, options.quick), sphere_under_sun(SIZE)
    measure = partial(study.rough, sphere, engines, options.samples, options.quick)
    title = "Error of the lobes and RMS error on a sphere, light at the angle from the viewer, in %"
    return show(terminal, work, measure, title, study.rough_table)


def engines(_options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold EEVEE against Cycles, under three lights and a sky."""
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import rough as study

    if len(engines) < len(NODE_ENGINES):
        raise BadInput("EEVEE and Cycles are both needed to hold them against each other")
    work, measure = study.between_engines_work(), partial(study.between_engines, sphere_under_sun(BOTH_SIZE))
    return show(terminal, work, measure, "RMS difference of EEVEE from Cycles, in %", study.between_engines_table)


def stability(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold GLSL and OSL in 32-bit floats against their formulas in 50 digits, and the plain subsurface formulas against ours."""
    try:
        from true_diffuse.scripts.studies import reference_mpmath
    except ImportError as error:
        raise BadInput(f"the formulas in all digits need a package that is not installed: {error}") from error
    from true_diffuse.addon.blender.engines import CYCLES, EEVEE
    from true_diffuse.addon.blender.osl import compiles_osl
    from true_diffuse.scripts.studies import float32_accuracy, stability_glsl, stability_osl, stability_subsurface

    targets: list[tuple[str, ModuleType]] = [("GLSL", stability_glsl)] if EEVEE in engines else []
    if CYCLES in engines and compiles_osl():
        targets.append(("OSL", stability_osl))
    if not targets:
        raise BadInput("GLSL needs EEVEE's graphics driver, OSL a Cycles that compiles it")
    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    records = []
    for name, target in targets:
        count = target.COUNT // 10 if options.quick else target.COUNT
        measure = partial(target.stability, reference_mpmath.radiance, quick, count)
        records += show(terminal, target.work(), measure, f"{name} in 32-bit floats: the largest errors", float32_accuracy.table)
    formulas = list(stability_subsurface.records())
    terminal.table("Subsurface formulas at their ends", *stability_subsurface.table(formulas))
    return records + formulas


def cost(_options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Time equation (1) in GLSL, and the node group against Blender's own Diffuse BSDF."""
    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scenes import five_characters
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import cost

    sphere, five = sphere_under_sun(cost.FRAME), five_characters.build(load_character("human"), 0.8, True, cost.FRAME_OF_FIVE)
    with terminal.progress(cost.work(engines)) as progress:
        records = list(cost.forms(progress)) if EEVEE in engines else []
        records += cost.groups(sphere, five, engines, progress)
    terminal.table("Cost", *cost.table(records))
    return records


def frames(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Time frames of True Diffuse Realtime: each model and form of equation (1) against Lambert's law, and how the cost grows."""
    import gpu

    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scripts.studies import frame_time as study

    if EEVEE not in engines:
        raise BadInput("frames need EEVEE's graphics driver")
    characters = study.Characters(load_character("human"), study.QUICK_RESOLUTION if options.quick else study.RESOLUTION)
    with terminal.progress(study.work(options.quick)) as progress:
        records = list(study.records(characters, options.quick, progress))
    renderer = gpu.platform.renderer_get()
    absolute = not study.is_software(renderer)
    terminal.say(f"Drawn by {renderer}" + ("" if absolute else ": software rendering, so ratios alone"))
    for clock in ("readback", "processor"):
        title = f"A frame's time by {clock} over that of lambert.glsl / of plain Lambert, medians"
        terminal.table(title, *study.table(records, clock, absolute))
    if not options.quick:
        terminal.table(
            "What of a frame's time is fixed and what grows, on the line through all", *study.growth_table(records, absolute)
        )
    return records


def furnace(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold what each model, target and quality reflects of a uniform world against its formula."""
    from true_diffuse.scripts.studies import robustness

    work, measure = robustness.furnace_work(engines, options.quick), partial(robustness.furnace, engines, options.quick)
    title = "Albedo at rho = 1 in a uniform world, the formula's in brackets"
    return show(terminal, work, measure, title, robustness.furnace_table)


def leak(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Look for light from behind on closed bodies."""
    from true_diffuse.scripts.studies import robustness

    work, measure = robustness.leak_work(engines, options.quick), partial(robustness.leak, engines, options.quick)
    title = "Light from behind, as a share of what a lit Lambert surface shows"
    return show(terminal, work, measure, title, robustness.leak_table)


def extremes(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Render inputs at the ends of their ranges and beyond them."""
    from true_diffuse.scripts.studies import robustness

    work, measure = robustness.extremes_work(engines, options.quick), partial(robustness.extremes, engines, options.quick)
    return show(terminal, work, measure, "Radiance of odd inputs, over all views, lights and models", robustness.extremes_table)


def subsurface(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold the group Subsurface on a slab against its model: profiles, edges of shadows, albedos, furnace, units, extremes."""
    from true_diffuse.scripts.studies import subsurface as study

    records = []
    for measurement in study.MEASUREMENTS:
        work, measure = measurement.work(engines, options.quick), partial(measurement.records, engines, options.quick)
        records += show(terminal, work, measure, measurement.title, study.table)
    return records


def usd(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold each rough model against its formula after it has gone through USD, in MaterialX's GLSL and in Hydra Storm."""
    from true_diffuse.addon import usd as usd_files
    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import usd as study

    if EEVEE not in engines:
        raise BadInput("Hydra Storm needs EEVEE's graphics driver")
    usd_files.register()
    with tempfile.TemporaryDirectory() as folder, terminal.progress(study.work(options.quick)) as progress:
        found = list(study.records(sphere_under_sun(SIZE), Path(folder), check_usd, options.quick, progress))
    terminal.table("Error after the way through USD, light at the angle from the viewer, in %", *study.table(found))
    return found


def optimize(_options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold optimized materials of four scenes against whole ones: the picture, nodes, closures, first and later renders."""
    from true_diffuse.addon import usd as usd_files
    from true_diffuse.scripts.studies import optimize as study

    usd_files.register()
    with tempfile.TemporaryDirectory() as folder:
        work, measure = study.work(engines), partial(study.records, partial(load_character, "human"), engines, Path(folder))
        return show(terminal, work, measure, "What optimized materials save, before -> after", study.table)


def animation(options: Namespace, engines: list["Engine"], terminal: Terminal) -> list["Record"]:
    """Hold keyed frames against stills of their values, and what noise flickers between frames against the noise."""
    from true_diffuse.addon.blender.engines import EEVEE, REALTIME
    from true_diffuse.scripts.studies import animation as study

    used = list(engines)
    if EEVEE in engines:  # so there is a graphics driver
        register_realtime()
        used.append(REALTIME)
    work, measure = study.work(used), partial(study.records, used, options.samples, SIZE // 2)
    return show(terminal, work, measure, "Frames of a film: difference from stills, noise, flicker", study.table)


def check_usd(file: Path) -> list["Record"]:
    """Return what check_usd.py finds, in a process without Blender's copies of OpenUSD and MaterialX."""
    command = [sys.executable, str(Path(__file__).with_name("check_usd.py")), "--json", str(file)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if not result.stdout:
        raise BadInput(f"check_usd.py does not run here: {result.stderr.strip().splitlines()[-1]}")
    return json.loads(result.stdout)


MEASURES: dict[str, Measure] = {
    "rough": rough,
    "engines": engines,
    "stability": stability,
    "cost": cost,
    "frames": frames,
    "furnace": furnace,
    "leak": leak,
    "extremes": extremes,
    "subsurface": subsurface,
    "usd": usd,
    "optimize": optimize,
    "animation": animation,
}


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="accuracy.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=tuple(MEASURES), help="; ".join(f"{key}: {_what(key)}" for key in MEASURES))
    parser.add_argument(
        "--engine",
        type=partial(engine_list, known=NODE_ENGINES),
        default=NODE_ENGINES,
        metavar="LIST",
        help="default: eevee,cycles",
    )
    parser.add_argument("--samples", type=sample_count, default=4, metavar="N", help="per pixel (default: 4)")
    parser.add_argument("--quick", action="store_true", help="the paper's model at sigma 0.33 alone, and fewer lights and inputs")
    parser.add_argument("--out", type=Path, default=Path("accuracy.json"), metavar="FILE", help="default: accuracy.json")
    options = parser.parse_args(script_arguments())
    if options.out.is_dir():
        parser.error(f"{options.out} is a folder")
    return run_script(parser.prog, options.out.parent, partial(measure, options))


def _what(key: str) -> str:
    """Return the first sentence of a measure's description as an option's help has it."""
    text = (MEASURES[key].__doc__ or "").splitlines()[0].rstrip(".")
    return text[0].lower() + text[1:]


def measure(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Measure and write the records."""
    engines = start_blender(options.engine, terminal)
    from true_diffuse.addon.probe.environment import environment

    records = []
    for key in [options.only] if options.only else MEASURES:
        empty_file()  # none may inherit another's scene: `rough` ends with Open Shading Language on
        records += MEASURES[key](options, engines, terminal)
    output.write_json(options.out.name, {"records": records, "environment": environment(engines)})
    output.publish()
    terminal.say(f"Wrote {options.out}")


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
