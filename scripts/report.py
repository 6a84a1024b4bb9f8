# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the work-precision study: what an error costs in each engine, mode and model, and in what Blender has instead.

uv run scripts/report.py --quick
"""

import csv
import io
import os
import sys
import time
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, script_arguments
from true_diffuse.scripts.cli.outputs import Staging
from true_diffuse.scripts.cli.startup import ENGINE_KEYS, engine_list, load_bpy, load_character, run_script, start_blender
from true_diffuse.scripts.farm import jobs

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.addon.measure.record import Record
    from true_diffuse.scripts.studies.work_precision.journal import Journal, Notes
    from true_diffuse.scripts.studies.work_precision.test_scenes import Stage

SCENES = ("sphere", "furnace", "five", "face")
VERSION = 1  # of report.json
# Compiling shaders is measured, so the driver must not know them from an earlier run.
NO_SHADER_CACHE = {"MESA_SHADER_CACHE_DISABLE": "true", "__GL_SHADER_DISK_CACHE": "0"}
SHADERS_WORK, RANDOM_INPUTS = 15.0, 2000  # [s], of each model
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
    os.environ.update(NO_SHADER_CACHE)
    return run_script(parser.prog, options.out, partial(report, options), AGAIN)


def report(options: Namespace, staging: Staging, terminal: Terminal) -> None:
    """Measure what is not measured yet, write everything into `staging` and publish it."""
    engines = start_blender(options.engine, terminal)
    from true_diffuse.addon.probe.environment import environment
    from true_diffuse.scripts.studies.work_precision import journal as journals

    machine = environment(engines)
    asked = asked_for(options.quick, [engine.key for engine in engines], options.scene, options.character[0])
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
    said = write({"environment": machine, "options": asked}, journal, "", staging)
    written = staging.publish()
    journal.remove()
    for line in said:
        terminal.say(line)
    terminal.say(f"Wrote {', '.join(written)} to {options.out}")


def asked_for(quick: bool, engines: Sequence[str], scenes: Sequence[str], character: str) -> dict[str, Any]:
    """Return what was asked for as report.json keeps it."""
    asked: dict[str, Any] = {"quick": quick, "engines": list(engines), "scenes": list(scenes)}
    return asked | ({"character": character} if "five" in scenes else {})


def write(made: dict[str, Any], journal: "Notes", prefix: str, staging: Staging) -> list[str]:
    """Stage the report, its names after `prefix`, of what a journal holds and how it was `made`; returns what it recommends."""
    from true_diffuse.scripts.studies.work_precision import page

    document: dict[str, Any] = {"version": VERSION, **made, **results(journal)}
    staging.write_json(f"{prefix}report.json", document)
    staging.write_text(f"{prefix}report.csv", table(document["curves"]))
    staging.write_text(f"{prefix}index.html", page.html(document))
    return [f"{one['scene']}, {one['engine']}: {one['text']}" for one in document["recommendations"]]


def order(options: Namespace, staging: Staging, terminal: Terminal) -> None:
    """Write the job that measures all of it."""
    load_bpy()
    from true_diffuse.scripts.farm.report import Order

    characters = jobs.characters(options.character)
    hard = not options.quick and find_spec("mpmath") is not None
    ordered = Order(characters, options.engine, options.scene, options.quick, hard)
    document = {"study": "report", "order": ordered.packed()}
    description = f"{', '.join(options.scene)} in {', '.join(options.engine)}, {len(characters)} characters"
    jobs.write_job(
        "True Diffuse, error against run time",
        description,
        document,
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
                hard_inputs(home, journal)


def shader_homes(engines: list["Engine"], journal: "Journal", terminal: Terminal) -> list[str]:
    """Return where models live that are still to be held against the formulas in all digits: GLSL, OSL."""
    from true_diffuse.addon.blender.osl import compiles_osl

    if find_spec("mpmath") is None:
        terminal.say("The formulas in all digits need the package mpmath: GLSL and OSL are not held against them")
        return []
    keys = [engine.key for engine in engines]
    homes = ["GLSL"] * ("eevee" in keys) + ["OSL"] * ("cycles" in keys and compiles_osl())
    return [home for home in homes if ("shaders", home) not in journal.units]


def hard_inputs(home: str, journal: "Notes") -> None:
    """Keep what a home of the models makes of random and of hard inputs, in 32-bit floats."""
    from true_diffuse.scripts.studies import reference_mpmath, stability_glsl, stability_osl
    from true_diffuse.scripts.studies.work_precision.stability import shaders
    from true_diffuse.scripts.studies.work_precision.test_scenes import Silent

    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    study = stability_glsl if home == "GLSL" else stability_osl
    found = list(study.stability(reference_mpmath.radiance, quick, RANDOM_INPUTS, Silent()))
    journal.add(("shaders", home), {"records": shaders(found)})


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


def results(journal: "Notes") -> "dict[str, list[Record]]":
    """Return what report.json holds beside the machine and the options."""
    from true_diffuse.scripts.studies.work_precision import claims, curves, run, stability, startup_time
    from true_diffuse.scripts.studies.work_precision.variants import SIGMA

    noise = {one["scene"]: one["error"] for one in journal.of(run.NOISE)}
    found = curves.curves(journal.of(run.UNIT), journal.of(run.COLD), noise)
    found += [curves.glsl(one, "Oren-Nayar", SIGMA) for one in journal.of(run.GLSL)]
    return {
        "scenes": list(journal.of("build")),
        "curves": found,
        "cold": startup_time.records(found, journal),
        "stability": list(stability.records()),
        "shaders": [record for one in journal.of("shaders") for record in one["records"]],
        "claims": claims.records(found, list(journal.of(run.FORM)), list(journal.of(run.LUMINANCE))),
        "recommendations": curves.recommendations(found),
    }


def table(curves: "list[Record]") -> str:
    """Return the points of all curves as CSV."""
    names = ("scene", "engine", "osl", "label", "kind", "group", "model", "mode", "sigma", "target", "reference", "reference_error")
    rows = [{**{name: curve[name] for name in names}, **point} for curve in curves for point in curve["points"]]
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]) if rows else list(names), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
