# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the work-precision study: what an error costs in each engine, mode and model, and in what Blender has instead.

uv run scripts/report.py --quick
"""

import os
import sys
import time
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli import startup
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, script_arguments
from true_diffuse.scripts.cli.outputs import Staging
from true_diffuse.scripts.cli.startup import ENGINE_KEYS, engine_list, load_bpy, load_character, run_script, start_blender
from true_diffuse.scripts.farm import jobs

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.scripts.studies.work_precision.journal import Journal
    from true_diffuse.scripts.studies.work_precision.test_scenes import Stage

SCENES = ("sphere", "furnace", "five", "face")
SHADERS_WORK = 15.0  # [s]
LEAST_WORK = 1e-9  # where all is done already
JOURNALS = {True: ".journal_quick", False: ".journal"}  # neither run takes the other's
AGAIN = "run it again to go on from here"


def scene_list(text: str) -> tuple[str, ...]:
    """The type of the option --scene: scenes, comma separated, in the order of SCENES."""
    keys = {part.strip().lower() for part in text.split(",")}
    for key in sorted(keys):
        if key not in SCENES:
            raise ArgumentTypeError(f"unknown scene {key!r}: choose from {', '.join(SCENES)}")
    return tuple(key for key in SCENES if key in keys)


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="report.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer contestants, samples and repeats, in four minutes")
    parser.add_argument("--engine", type=engine_list, default=ENGINE_KEYS, metavar="LIST", help=f"default: {','.join(ENGINE_KEYS)}")
    parser.add_argument("--scene", type=scene_list, default=SCENES, metavar="LIST", help=f"default: {','.join(SCENES)}")
    who = "of the scene five: human, monkey or a file (default: human); with --job any number, also patterns as 'shots/*.glb'"
    parser.add_argument("--character", nargs="+", action="extend", metavar="WHO", help=who)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (default: report; with --job the job's own)")
    job = "render nothing, but write a job bundle of Open Job Description that does"
    parser.add_argument("--job", type=Path, metavar="DIR", help=job)
    options = parser.parse_args(script_arguments())
    options.character = options.character or ["human"]
    if options.job:
        return run_script(parser.prog, options.job, partial(order, options))
    if len(options.character) > 1:
        parser.error("several characters need --job")
    options.out = options.out or Path("report")
    os.environ.update(startup.NO_SHADER_CACHE)
    return run_script(parser.prog, options.out, partial(report, options), AGAIN)


def report(options: Namespace, staging: Staging, terminal: Terminal) -> None:
    """Measure what is not measured yet, write everything into `staging` and publish it."""
    engines = start_blender(options.engine, terminal)
    from true_diffuse.addon.probe.environment import environment
    from true_diffuse.scripts.studies.work_precision import document
    from true_diffuse.scripts.studies.work_precision import journal as journals

    machine = environment(engines)
    asked = document.options(options.quick, [engine.key for engine in engines], options.scene, options.character[0])
    try:
        folder = options.out / JOURNALS[options.quick]
        journal = journals.Journal(folder, {"environment": machine, "options": asked, "sources": journals.sources()})
    except OSError as error:
        raise BadInput(f"cannot write to output folder {options.out}: {error.strerror}") from error
    if journal.is_foreign:
        terminal.say("What was measured before is of other options, another version or machine: all is measured anew")
    if journal.is_begun:
        terminal.say(f"Going on from {len(journal.units)} results that are there already")
    measure(options, engines, journal, terminal)
    texts, advice = document.files({"environment": machine, "options": asked}, journal)
    for name, text in texts.items():
        staging.write_text(name, text)
    written = staging.publish()
    journal.remove()
    for line in advice:
        terminal.say(line)
    terminal.say(f"Wrote {', '.join(written)} to {options.out}")


def order(options: Namespace, staging: Staging, terminal: Terminal) -> None:
    """Write the job that measures all of it."""
    load_bpy()
    from true_diffuse.scripts.farm.report import Order

    characters = jobs.characters(options.character)
    hard = not options.quick and find_spec("mpmath") is not None
    ordered = Order(characters, options.engine, options.scene, options.quick, hard)
    job = {"study": "report", "order": ordered.packed()}
    description = f"{', '.join(options.scene)} in {', '.join(options.engine)}, {len(characters)} characters"
    jobs.write_job(
        "True Diffuse, error against run time",
        description,
        job,
        jobs.report_steps(ordered),
        (options.job, options.out),
        staging,
        terminal,
    )


def measure(options: Namespace, engines: list["Engine"], journal: "Journal", terminal: Terminal) -> None:
    """Build the scenes and render what is left."""
    from true_diffuse.scripts.studies.work_precision import run

    terminal.say("Building the scenes")
    stages = build(options, engines, journal)
    parts, homes = run.plan(stages, journal), [] if options.quick else shader_homes(engines, journal, terminal)
    with terminal.progress(run.work(parts, engines, journal) + SHADERS_WORK * len(homes) + LEAST_WORK) as progress:
        run.run(parts, engines, journal, progress)
        for home in homes:
            with progress.step(f"Hard inputs  {home}", SHADERS_WORK):
                run.hard_inputs(home, journal)


def shader_homes(engines: list["Engine"], journal: "Journal", terminal: Terminal) -> list[str]:
    """Return where models live that are still to be held against the formulas in all digits: GLSL, OSL."""
    from true_diffuse.addon.blender.osl import compiles_osl

    if find_spec("mpmath") is None:
        terminal.say("The formulas in all digits need the package mpmath: GLSL and OSL are not held against them")
        return []
    keys = [engine.key for engine in engines]
    homes = ["GLSL"] * ("eevee" in keys) + ["OSL"] * ("cycles" in keys and compiles_osl())
    return [home for home in homes if ("shaders", home) not in journal.units]


def build(options: Namespace, engines: list["Engine"], journal: "Journal") -> list["Stage"]:
    """Return the scenes, and keep how long each took to build."""
    from true_diffuse.scripts.studies.work_precision import test_scenes

    (who,) = options.character
    made: dict[str, Callable[[], Stage]] = {
        "sphere": lambda: test_scenes.Sphere(engines, options.quick),
        "furnace": lambda: test_scenes.Furnace(engines, options.quick),
        "five": lambda: test_scenes.Five(engines, options.quick, load_character(who), bust=who == "human"),
        "face": lambda: test_scenes.FaceStage(engines, options.quick, load_character("human")),
    }
    built = []
    for name in options.scene:
        start = time.perf_counter()
        stage = made[name]()
        key = ("build", name)
        if key not in journal.units:
            journal.add(key, {"scene": name, "seconds": time.perf_counter() - start, "reference": stage.reference_text})
        built.append(stage)
    return built


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
