# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how near each target of each model comes to its formula, and writes records of it.

uv run scripts/accuracy.py --only rough --out accuracy.json
"""

import json
import subprocess
import sys
import tempfile
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.inputs import names, sample_count
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import (
    NODE_ENGINES,
    empty_file,
    load_character,
    register_properties,
    register_realtime,
    run_script,
    start_blender,
)
from true_diffuse.scripts.studies.study import Section, Step, Table, run
from true_diffuse.scripts.web import WebError

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.addon.measure.record import Record

SIZE = 96  # pixels across the sphere: 5000 to compare
BOTH_SIZE = 64  # where the engines are held against each other, as Cycles needs many samples

type Measure = Callable[[Namespace, list["Engine"]], Iterator[Section]]


def rough(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold each rough model, target and quality against its formula, on a sphere under a sun."""
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import rough as study

    title = "Error of the lobes and RMS error on a sphere, light at the angle from the viewer, in %"
    steps = study.rough(sphere_under_sun(SIZE), engines, options.samples, options.quick)
    yield Section(steps, {title: study.rough_table})


def mapped(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold each rough model against its formula where normals are mapped, bumped, or of a coarse smooth mesh."""
    from true_diffuse.scripts.studies import mapped_normal as study

    title = "RMS error and, in brackets, the largest, by the angle between N and the mesh's normal, in %"
    yield Section(study.steps(engines, options.quick), {title: study.table})


def engines(_options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold EEVEE against Cycles, under three lights and a sky."""
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import rough as study

    require_both(engines)
    steps = study.between_engines(sphere_under_sun(BOTH_SIZE))
    yield Section(steps, {"RMS difference of EEVEE from Cycles, in %": study.between_engines_table})


def soft(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold EEVEE against Cycles under area lights of four sizes, all around a sphere."""
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import rough as study

    require_both(engines)
    steps = study.soft(sphere_under_sun(BOTH_SIZE), options.quick)
    title = "RMS difference of EEVEE from Cycles under an area light, in %"
    yield Section(steps, {title: study.soft_table, "The same, beyond Lambert's": study.beyond_lambert_table})


def shadows(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold True Diffuse Realtime against Cycles under lights with a size, by the number of samples."""
    from true_diffuse.scripts.studies import soft_shadows as study

    register_beside_cycles(engines)
    title = "RMS difference of Realtime from Cycles: of all pixels / without the worst 1 % / in the mean"
    yield Section(study.steps(load_character("human"), options.quick), {title: study.table})


def camera(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold depth of field, motion blur and hair of True Diffuse Realtime against Cycles, by the number of samples."""
    from true_diffuse.scripts.studies import camera as study

    register_beside_cycles(engines)
    title = "RMS difference of Realtime from Cycles: of all pixels / without the worst 1 %"
    yield Section(study.steps(load_character("human"), options.quick), {title: study.table})


def skies(_options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold the Sky Texture of True Diffuse Realtime, and its sun, against Cycles."""
    from true_diffuse.scripts.studies import skies as study

    register_beside_cycles(engines)
    yield Section(study.steps(), {"Difference of Realtime from Cycles: RMS of skies, light of suns": study.table})


def world(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold True Diffuse Realtime against Cycles under skies with a sun, by the number of samples."""
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import world as study

    register_beside_cycles(engines)
    steps = study.steps(sphere_under_sun(BOTH_SIZE), options.quick)
    yield Section(steps, {"RMS difference of Realtime from Cycles under a sky": study.table})


def bounce(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold True Diffuse Realtime's bounce of light against Cycles with one bounce, by the number of samples."""
    from true_diffuse.scripts.studies import bounce as study

    register_beside_cycles(engines)
    title = "RMS difference of Realtime from Cycles with one bounce / in the mean, and milliseconds per sample"
    yield Section(study.steps(load_character("human"), options.quick), {title: study.table})


def stability(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
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
    for name, target in targets:
        count = target.COUNT // 10 if options.quick else target.COUNT
        steps = target.stability(reference_mpmath.radiance, quick, count)
        yield Section(steps, {f"{name} in 32-bit floats: the largest errors": float32_accuracy.table})
    steps = [Step("Subsurface formulas", stability_subsurface.records)]
    yield Section(steps, {"Subsurface formulas at their ends": stability_subsurface.table})


def cost(_options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Time equation (1) in GLSL, and the node group against Blender's own Diffuse BSDF."""
    from true_diffuse.scenes import five_characters
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import cost

    sphere, five = sphere_under_sun(cost.FRAME), five_characters.build(load_character("human"), 0.8, True, cost.FRAME_OF_FIVE)
    yield Section(cost.steps(sphere, five, engines), {"Cost": cost.table})


def scale(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Time files of 1 to 500 materials against as many of Blender's own Diffuse BSDF."""
    from true_diffuse.scripts.studies import scale as study

    with tempfile.TemporaryDirectory() as folder:
        steps = study.steps(engines, Path(folder), options.quick)
        yield Section(steps, {"CPU seconds of many materials (over those of the Diffuse BSDF)": study.table})


def frames(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Time frames of True Diffuse Realtime: each model and form of equation (1) against Lambert's law, and how the cost grows."""
    import gpu

    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scripts.studies import frame_time as study

    if EEVEE not in engines:
        raise BadInput("frames need EEVEE's graphics driver")
    characters = study.Characters(load_character("human"), study.QUICK_RESOLUTION if options.quick else study.RESOLUTION)
    renderer = gpu.platform.renderer_get()
    absolute = not study.is_software(renderer)
    drawn = f"Drawn by {renderer}{'' if absolute else ': software rendering, so ratios alone'}"
    title = f"{drawn}\nA frame's time by {{}} over that of lambert.glsl / of plain Lambert, medians"
    tables: dict[str, Callable[[Sequence[Record]], Table]] = {}
    for clock in ("readback", "processor"):
        tables[title.format(clock)] = partial(study.table, clock=clock, absolute=absolute)
    if not options.quick:
        title = "What of a frame's time is fixed and what grows, on the line through all"
        tables[title] = partial(study.growth_table, absolute=absolute)
    yield Section(study.steps(characters, options.quick), tables)
    yield from competitors(options)


def first(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Time the first picture of a viewport of True Diffuse Realtime."""
    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scripts.studies import first_picture as study
    from true_diffuse.scripts.studies.competitors import QUICK_SIZE, SIZE

    if EEVEE not in engines:
        raise BadInput("the first picture needs EEVEE's graphics driver")
    empty_file()
    register_realtime()
    title = "The first picture after switching engines, by its parts, in ms of processor time"
    small = "Objects of a triangle each in 16 x 16 pixels, in ms of processor time: what a frame takes beside drawing"
    steps = study.steps(load_character("human"), QUICK_SIZE if options.quick else SIZE, options.quick)
    yield Section(steps, {title: study.table, small: study.overhead_table})


def competitors(options: Namespace) -> Iterator[Section]:
    """Time frames of Realtime, EEVEE and three.js."""
    import gpu

    from true_diffuse.scripts.studies import competitors as study
    from true_diffuse.scripts.studies.web import enable_export
    from true_diffuse.scripts.web.browser import DRIVER, browser

    empty_file()
    register_properties()
    enable_export()
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        crowd = study.Crowd(load_character("human"), study.QUICK_SIZE if options.quick else study.SIZE)
        try:
            shared = stack.enter_context(browser(DRIVER))
            three = study.Three(shared, stack.enter_context(shared.page(study.files(folder))))
            there = f"three.js by {three.renderer}"
        except WebError as error:
            three, there = None, f"three.js is left out: {error}"
        width, height = crowd.size
        title = (
            f"A frame of {width} x {height} pixels in ms of processor time, and in brackets over Realtime's\n"
            f"Realtime and EEVEE by {gpu.platform.renderer_get()}, {there}"
        )
        yield Section(study.steps(crowd, three, folder, options.quick), {title: study.table})


def viewport(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Time what edits cost a viewport of True Diffuse Realtime, by the number of objects."""
    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scripts.studies import viewport as study

    if EEVEE not in engines:
        raise BadInput("a viewport needs EEVEE's graphics driver")
    register_realtime()
    title = "What an edit costs a viewport: reading the scene + drawing the first sample, in ms of processor time"
    yield Section(list(study.steps(options.quick)), {title: study.table})


def furnace(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold what each model, target and quality reflects of a uniform world against its formula."""
    from true_diffuse.scripts.studies import furnace as study

    title = "Albedo at rho = 1 in a uniform world, the formula's in brackets"
    yield Section(study.furnace(engines, options.quick), {title: study.table})


def leak(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Look for light from behind on closed bodies."""
    from true_diffuse.scripts.studies import light_leaks as study

    title = "Light from behind, as a share of what a lit Lambert surface shows"
    yield Section(study.leak(engines, options.quick), {title: study.table})


def extremes(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Render inputs at the ends of their ranges and beyond them."""
    from true_diffuse.scripts.studies import hard_inputs as study

    title = "Radiance of odd inputs, over all views, lights and models"
    yield Section(study.extremes(engines, options.quick), {title: study.table})


def subsurface(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold the group Subsurface on a slab against its model: profiles, edges of shadows, albedos, furnace, units, extremes."""
    from true_diffuse.scripts.studies import subsurface as study

    for title, steps in study.SECTIONS.items():
        yield Section(steps(engines, options.quick), {title: study.table})


def thin(_options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold the light that Realtime and Cycles have through slabs of skin against radiative transfer."""
    from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME
    from true_diffuse.scripts.studies import thin as study

    if EEVEE not in engines:
        raise BadInput("light through skin needs EEVEE's graphics driver")
    register_realtime()
    used = [CYCLES, REALTIME] if CYCLES in engines else [REALTIME]
    yield Section(study.steps(used), {"What of the light comes through a slab of skin, lit from behind": study.table})


def ears(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold the light that EEVEE and Realtime have through ears against Cycles, in light and dark skin, and time EEVEE's."""
    from true_diffuse.scripts.studies import ears as study

    require_both(engines)
    register_realtime()
    mesh = load_character("human")
    title = "Radiance of skin under a key light and one from behind, red, green and blue, over that in Cycles (RMS difference)"
    yield Section(study.steps(mesh, options.quick), {title: study.table})
    yield Section(study.costs(mesh), {"What EEVEE takes for a head of skin": study.table_of_costs})


def usd(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold each rough model against its formula after it has gone through USD, in MaterialX's GLSL and in Hydra Storm."""
    from true_diffuse.addon import usd as usd_files
    from true_diffuse.addon.blender.engines import EEVEE
    from true_diffuse.scenes.sphere import sphere_under_sun
    from true_diffuse.scripts.studies import usd as study

    if EEVEE not in engines:
        raise BadInput("Hydra Storm needs EEVEE's graphics driver")
    usd_files.register()
    title = "Error after the way through USD, light at the angle from the viewer, in %"
    with tempfile.TemporaryDirectory() as folder:
        yield Section(study.steps(sphere_under_sun(SIZE), Path(folder), check_usd, options.quick), {title: study.table})


def web(options: Namespace, _engines: list["Engine"]) -> Iterator[Section]:
    """Hold each rough model against its formula in a glTF file, drawn by three.js and Babylon.js in a browser."""
    from true_diffuse.scripts.studies import web as study
    from true_diffuse.scripts.web.browser import browser
    from true_diffuse.scripts.web.engines import PAGES, engine

    register_properties()
    study.enable_export()
    title = "RMS error after the way through glTF, light at 0, 60 and 120\u00b0 from the viewer, and three lights, in %"
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        shared = stack.enter_context(browser())
        pages = [stack.enter_context(engine(name, shared, folder)) for name in PAGES]
        yield Section(study.steps(pages, folder, options.quick), {title: study.table})


def handlers(_options: Namespace, _engines: list["Engine"]) -> Iterator[Section]:
    """Time the handlers at thousands of objects."""
    from true_diffuse.scripts.studies import handlers as study

    yield Section(study.steps(), {"What handlers take": study.table})


def animation(options: Namespace, engines: list["Engine"]) -> Iterator[Section]:
    """Hold keyed frames against stills of their values, and what noise flickers between frames against the noise."""
    from true_diffuse.addon.blender.engines import EEVEE, REALTIME
    from true_diffuse.scripts.studies import animation as study

    used = list(engines)
    if EEVEE in engines:  # so there is a graphics driver
        register_realtime()
        used.append(REALTIME)
    title = "Frames of a film: difference from stills, noise, flicker"
    yield Section(study.steps(used, options.samples, SIZE // 2), {title: study.table})


def require_both(engines: list["Engine"]) -> None:
    """Raise BadInput unless EEVEE and Cycles are both among `engines`."""
    if len(engines) < len(NODE_ENGINES):
        raise BadInput("EEVEE and Cycles are both needed to hold them against each other")


def register_beside_cycles(engines: list["Engine"]) -> None:
    """Register True Diffuse Realtime, to be held against Cycles. Raises BadInput where `engines` are not both there."""
    if len(engines) < len(NODE_ENGINES):
        raise BadInput("Cycles and EEVEE's graphics driver are both needed")
    register_realtime()


def check_usd(file: Path) -> list["Record"]:
    """Return what check_usd.py finds, in a process without Blender's copies of OpenUSD and MaterialX."""
    command = [sys.executable, str(Path(__file__).with_name("check_usd.py")), "--json", str(file)]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if not result.stdout:
        raise BadInput(f"check_usd.py does not run here: {result.stderr.strip().splitlines()[-1]}")
    return json.loads(result.stdout)


MEASURES: dict[str, Measure] = {
    measure.__name__: measure
    for measure in (
        rough,
        mapped,
        engines,
        soft,
        shadows,
        world,
        bounce,
        camera,
        skies,
        stability,
        cost,
        scale,
        frames,
        first,
        viewport,
        furnace,
        leak,
        extremes,
        subsurface,
        thin,
        ears,
        usd,
        web,
        handlers,
        animation,
    )
}
LONG = ("soft",)  # what takes so long that it is measured alone


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="accuracy.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=tuple(MEASURES), help="; ".join(f"{key}: {_what(key)}" for key in MEASURES))
    parser.add_argument(
        "--engine",
        type=names("engine", NODE_ENGINES),
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
    return run_script(parser.prog, options.out.parent, partial(measure, options), name=options.out.name)


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
        if key in LONG and not options.only and not options.quick:
            terminal.say(f"{key} is left out, as it takes up to an hour: --only {key} measures it, --quick a little of it")
            continue
        empty_file()  # none may inherit another's scene: `rough` ends with Open Shading Language on
        try:
            for section in MEASURES[key](options, engines):
                with terminal.progress(sum(step.work for step in section.steps)) as progress:
                    found = list(run(section.steps, progress))
                for title, table in section.tables.items():
                    terminal.table(title, *table(found))
                records += found
        except (BadInput, WebError) as error:
            if options.only:
                raise
            terminal.say(f"{key} is left out: {error}")
    output.write_json(options.out.name, {"records": records, "environment": environment(engines)})
    output.publish()
    terminal.say(f"Wrote {options.out}")


if __name__ == "__main__":
    end(main())
