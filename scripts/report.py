# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the work-precision study: what an error costs in each engine, quality and model, and in what Blender has instead.

uv run scripts/report.py --quick
"""

import os
import sys
import time
from argparse import Namespace
from dataclasses import asdict
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli import inputs, startup
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import ENGINE_KEYS, load_bpy, run_script, start_blender

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.scripts.studies.work_precision.journal import Journal
    from true_diffuse.scripts.studies.work_precision.test_scenes import TestScene

SCENES = ("sphere", "furnace", "five", "face")
JOURNALS = {True: ".journal_quick", False: ".journal"}  # neither run takes the other's
AGAIN = "run it again to go on from here"


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="report.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer variants, samples and repeats, in four minutes")
    engine = inputs.names("engine", ENGINE_KEYS)
    parser.add_argument("--engine", type=engine, default=ENGINE_KEYS, metavar="LIST", help=f"default: {','.join(ENGINE_KEYS)}")
    scene = inputs.names("scene", SCENES)
    parser.add_argument("--scene", type=scene, default=SCENES, metavar="LIST", help=f"default: {','.join(SCENES)}")
    who = "of the scene five: human, monkey or a file (default: human); with --job any number, also patterns as 'shots/*.glb'"
    parser.add_argument("--character", nargs="+", action="extend", metavar="WHO", help=who)
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder to write (default: report; with --job the job's own)")
    job = "render nothing, but write a job bundle of Open Job Description that does"
    parser.add_argument("--job", type=Path, metavar="DIR", help=job)
    options = parser.parse_args(script_arguments())
    options.character = options.character or ["human"]
    if options.job:
        return run_script(parser.prog, options.job, partial(write_job, options))
    if len(options.character) > 1:
        parser.error("several characters need --job")
    options.out = options.out or Path("report")
    os.environ.update(startup.NO_SHADER_CACHE)
    return run_script(parser.prog, options.out, partial(report, options), AGAIN)


def report(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Measure what is not measured yet, write everything into `output` and publish it."""
    engines = start_blender(options.engine, terminal)
    inputs.checked_characters(options.character)
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
        output.write_text(name, text)
    written = output.publish()
    journal.remove()
    for line in advice:
        terminal.say(line)
    terminal.say(f"Wrote {', '.join(written)} to {options.out}")


def write_job(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Write the job that measures all of it."""
    load_bpy()
    from true_diffuse.scripts.farm import bundle
    from true_diffuse.scripts.farm.report import JobSpec, steps

    characters, files = inputs.checked_characters(options.character)
    hard_inputs = not options.quick and find_spec("mpmath") is not None
    spec = JobSpec(characters, options.engine, options.scene, options.quick, hard_inputs)
    document = {"study": "report", "spec": asdict(spec)}
    description = f"{', '.join(options.scene)} in {', '.join(options.engine)}, {len(characters)} characters"
    name = "True Diffuse, error against run time"
    bundle.write(name, description, document, steps(spec), files, options.out, output, terminal)


def measure(options: Namespace, engines: list["Engine"], journal: "Journal", terminal: Terminal) -> None:
    """Build the scenes and render what is left."""
    from true_diffuse.scripts.studies.work_precision import run

    terminal.say("Building the scenes")
    remaining = run.plan(build(options, engines, journal), engines, journal)
    targets = [] if options.quick else hard_input_targets(engines, journal, terminal)
    starts = next((left.scene for left in remaining if left.starts_eevee), None)
    work = sum(left.seconds for left in remaining) + run.STARTUP_WORK * bool(starts) + run.HARD_WORK * len(targets)
    with terminal.progress(work) as progress:
        if starts:
            with progress.step("Starting EEVEE", run.STARTUP_WORK):
                run.start_eevee(starts, journal)
        for left in remaining:
            run.run(left, journal, progress)
        for target in targets:
            with progress.step(f"Hard inputs  {target}", run.HARD_WORK):
                run.hard_inputs(target, journal)


def hard_input_targets(engines: list["Engine"], journal: "Journal", terminal: Terminal) -> list[str]:
    """Return the targets of the models that are still to be held against the formulas in all digits: GLSL, OSL."""
    from true_diffuse.addon.blender.osl import compiles_osl
    from true_diffuse.scripts.studies.work_precision.run import HARD_INPUTS, TARGETS

    if find_spec("mpmath") is None:
        terminal.say("The formulas in all digits need the package mpmath: GLSL and OSL are not held against them")
        return []
    targets = [TARGETS[engine.key] for engine in engines if engine.key in TARGETS]
    return [target for target in targets if (HARD_INPUTS, target) not in journal.units and (target != "OSL" or compiles_osl())]


def build(options: Namespace, engines: list["Engine"], journal: "Journal") -> list["TestScene"]:
    """Return the scenes, and keep how long each took to build. Raises BadInput where a character cannot be had."""
    from true_diffuse.scripts.characters.character import CharacterError
    from true_diffuse.scripts.studies.work_precision import run, test_scenes

    built = []
    for name in options.scene:
        start = time.perf_counter()
        try:
            scene = test_scenes.build(name, engines, options.quick, options.character[0])
        except CharacterError as error:
            raise BadInput(str(error)) from error
        if (run.BUILD, name) not in journal.units:
            about = {"scene": name, "seconds": time.perf_counter() - start, "reference": scene.reference_text}
            journal.add((run.BUILD, name), about)
        built.append(scene)
    return built


if __name__ == "__main__":
    end(main())
