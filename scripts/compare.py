# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the paper's figures in EEVEE, Cycles and Realtime and measures every pixel.

Five characters against the analytic models; a face, with and without subsurface scattering, in one engine against another; where
a narrow beam's light leaves a slab, against Burley and the dipole.

uv run scripts/compare.py [OPTIONS]
blender -b --python scripts/compare.py -- [OPTIONS]
"""

import math
import sys
from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli import inputs
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import ENGINE_KEYS, load_bpy, run_script, start_blender

if TYPE_CHECKING:
    from true_diffuse.addon.blender.engines import Engine
    from true_diffuse.addon.measure.record import Record
    from true_diffuse.addon.probe.tolerance import Choice
    from true_diffuse.scripts.studies.comparison import five
    from true_diffuse.scripts.studies.comparison.base import Collected, JobSpec, Renderer, WorkItem

OPTION_NAMES = {"characters": "character", "sigmas": "sigma", "full_figure": "full-figure"}  # where they are not the attributes'
INCLUDED = ("human", "monkey")
LARGE_PAGE = 3_000_000  # bytes
REPORT, OUT = Path("report/report.json"), Path("comparison")

type Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]  # title, columns and rows
type Found = tuple[dict[str, Any], list[Table]]  # what compare.json holds beside the options, and what the terminal shows


@dataclass(frozen=True)
class Scene:
    """What can be compared: how, and the defaults of the options that it has beside those of all scenes."""

    compare: Callable[[Namespace, list["Engine"], OutputFolder, Terminal], Found]
    resolution: tuple[int, int]
    samples: Mapping[str, int]  # by the keys of the engines that render it
    options: Mapping[str, object]  # by name

    @property
    def engines(self) -> str:
        return ",".join(self.samples)


def main() -> int:
    """Run the script; returns the exit status."""
    options = parse(script_arguments())
    if options.job:
        return run_script("compare.py", options.job, partial(write_job, options))
    return run_script("compare.py", options.out, partial(compare, options))


def parse(arguments: list[str]) -> Namespace:
    """Return the options, None where the scene has none; ends the process with one line and status 2 where they make no sense."""

    def defaults(show: Callable[[Scene], str]) -> str:
        return "default: " + "; ".join(f"{name}: {show(scene)}" for name, scene in SCENES.items())

    parser = Parser(prog="compare.py", description=__doc__.splitlines()[0])
    add = parser.add_argument
    text = f"engines, comma separated ({defaults(lambda scene: scene.engines)})"
    add("--engine", dest="engines", type=inputs.names("engine", ENGINE_KEYS), metavar="LIST", help=text)
    add("--scene", choices=SCENES, default="five", help="what to compare (default: five)")
    text = f"pixels ({defaults(lambda scene: '{}x{}'.format(*scene.resolution))})"
    add("--resolution", type=_resolution, metavar="WxH", help=text)
    text = f"per pixel ({defaults(lambda scene: ', '.join(f'{key} {count}' for key, count in scene.samples.items()))})"
    add("--samples", type=inputs.sample_count, metavar="N", help=text)
    text = 'five: instead of --samples: the error to stay below, as "2%%" or 2; the fastest quality and samples are picked for it'
    add("--error", type=inputs.percentage, metavar="PERCENT", help=text)
    text = f"report of scripts/report.py on this machine to pick from (default: {REPORT})"
    add("--report", type=Path, default=REPORT, metavar="FILE", help=text)
    text = "human, monkey, or a .blend, .usd, .usda, .usdc, .usdz, .glb, .gltf or .obj file (default: human); "
    text += "any number of them, also patterns as 'shots/**/*.glb'"
    add("--character", dest="characters", nargs="+", action="extend", metavar="WHO", help=text)
    text = "five: frames of the characters' own animation, as 1-24, 1-24:4 or 1,5,9"
    add("--frames", type=inputs.frame_numbers, metavar="LIST", help=text)
    add("--sigma", dest="sigmas", type=_sigmas, metavar="LIST", help="five: facet slopes in radians (default: 0,0.2,0.33)")
    add(
        "--albedo",
        type=inputs.number(float, 0.0, 1.0),
        metavar="RHO",
        help="five: of plaster's lightest paint, 0 to 1 (default: 0.8)",
    )
    text = "five: show the human from head to toe instead of as a bust"
    add("--full-figure", action="store_const", const=True, help=text)
    text = "five: show a character's file as one mesh in one color instead of as it is"
    add("--plaster", action="store_const", const=True, help=text)
    add("--out", type=Path, metavar="DIR", help=f"folder to write (default: {OUT}; with --job the job's own)")
    add("--save-blend", action="store_true", help="also write SCENE.blend, the scene to open in Blender")
    text = "five: also write viewer.html, the characters to turn and to light in a browser, in one file; of frames the first"
    add("--web", action="store_const", const=True, help=text)
    text = "five, face: render nothing, but write a job bundle of Open Job Description that does"
    add("--job", type=Path, metavar="DIR", help=text)
    add("--chunk", type=inputs.number(int, 1, inputs.MOST_FRAMES), metavar="N", help="with --job: frames of one task (default: 8)")
    options = parser.parse_args(arguments)
    scene = SCENES[options.scene]
    for key in options.engines or ():
        if key not in scene.samples:
            parser.error(f"--scene {options.scene} is not for {key}: choose from {scene.engines}")
    if options.error is not None and options.samples is not None:
        parser.error("--error picks the samples: leave out --samples")
    if options.job and (options.error is not None or options.save_blend):
        parser.error("--job has no option --error and no --save-blend")
    if options.job and options.web:
        parser.error("--job has no --web: leave out one of them")
    if options.chunk and not options.job:
        parser.error("--chunk is of --job")
    if options.save_blend and len(options.characters or ()) > 1:
        parser.error("--save-blend is of one --character")
    if options.albedo is not None and not options.plaster and any(who not in INCLUDED for who in options.characters or ()):
        parser.error("--albedo is of --plaster, human and monkey: other characters have their own")
    for name in SCENES["five"].options:  # which has all of them
        if getattr(options, name) is None:
            setattr(options, name, scene.options.get(name))
        elif name not in scene.options:
            parser.error(f"--scene {options.scene} has no option --{OPTION_NAMES.get(name, name)}")
    options.engines = options.engines or tuple(scene.samples)
    options.resolution = options.resolution or scene.resolution
    options.report = options.report if options.error else None
    options.out = options.out or OUT
    return options


def _resolution(text: str) -> tuple[int, int]:
    width, by, height = text.lower().partition("x")
    if not by:
        raise ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT in pixels")
    side = inputs.number(int, 16, 16384)
    return side(width), side(height)


def _sigmas(text: str) -> tuple[float, ...]:
    sigma = inputs.number(float, 0.0, math.pi / 2)
    values = tuple(dict.fromkeys(sigma(part) + 0.0 for part in text.split(",")))  # -0.0 + 0.0 is 0.0
    if len(values) > 8:
        raise ArgumentTypeError(f"at most 8 sigmas fit in the picture, not {len(values)}")
    return values


def compare(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Render, measure and write everything into `output`, then publish it."""
    document, tables = SCENES[options.scene].compare(options, start_blender(options.engines, terminal), output, terminal)
    output.write_json("compare.json", {**document, "options": vars_of(options)})
    written = output.publish()
    for table in tables:
        terminal.table(*table)
    terminal.say(f"Wrote {', '.join(written)} to {options.out}")


def job_spec(options: Namespace, engines: Sequence[str], choices: Mapping[str, "Choice"]) -> tuple["JobSpec", tuple[Path, ...]]:
    """Return what the options ask for of the five characters or the face, and all files that the characters need.

    Raises BadInput where one of these is missing.
    """
    from true_diffuse.scripts.studies.comparison import face, five

    defaults = SCENES[options.scene].samples
    characters, files = inputs.checked_characters(options.characters)
    asked: dict[str, Any] = {
        "characters": characters,
        "engines": tuple(engines),
        "samples": {key: choices[key].samples if key in choices else options.samples or defaults[key] for key in engines},
        "resolution": options.resolution,
    }
    if options.scene == "face":
        return face.JobSpec(**asked), files
    spec = five.JobSpec(
        **asked,
        frames=options.frames or (None,),
        sigmas=options.sigmas,
        albedo=options.albedo,
        full_figure=options.full_figure,
        plaster=options.plaster,
        configurations={key: five.Configuration(choice.quality, choice.osl) for key, choice in choices.items()},
        **({"chunk": options.chunk} if options.chunk else {}),
    )
    return spec, files


def write_job(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Write the job that renders and measures the scene."""
    load_bpy()
    from true_diffuse.scripts.farm import bundle, comparison

    spec, files = job_spec(options, options.engines, {})
    document = {"study": options.scene, "spec": asdict(spec), "options": vars_of(options)}
    description = f"{len(spec.characters)} characters, {len(spec.frames)} frames, {', '.join(spec.engines)}"
    results = None if options.out == OUT else options.out
    name = f"True Diffuse, scene {options.scene}"
    bundle.write(name, description, document, comparison.steps(spec), files, results, output, terminal)


def compare_five(options: Namespace, chosen: list["Engine"], output: OutputFolder, terminal: Terminal) -> Found:
    """Compare the five characters with the analytic models."""
    from true_diffuse.scripts.studies import five
    from true_diffuse.scripts.studies.comparison.five import Renderer

    choices = _pick(options, chosen, terminal)

    def write_viewer(renderer: Renderer, item: "WorkItem") -> None:
        if options.web and item.frame == renderer.spec.frames[0]:
            _write_viewer(renderer, item, output, terminal)

    collected = _render(Renderer, chosen, choices, options, output, terminal, write_viewer)
    reached = _reached(options, choices, collected.records, terminal)
    tables: list[Table] = [("Error against the analytic model, key light alone", *five.table(collected.records))]
    if held := collected.realtime_from_cycles:
        tables.append(("Realtime from Cycles with no bounces, key light alone", *five.realtime_table(held)))
    return collected.document() | ({"choices": reached} if reached else {}), tables


def compare_face(options: Namespace, chosen: list["Engine"], output: OutputFolder, terminal: Terminal) -> Found:
    """Compare the engines' heads with BRDF, BSSRDF and the mixed model with those of Cycles, region by region."""
    from true_diffuse.scripts.studies import face
    from true_diffuse.scripts.studies.comparison.face import Renderer

    collected = _render(Renderer, chosen, {}, options, output, terminal)
    title = "On skin, RMS difference from Cycles, key and back light alone"
    return collected.document(), [(title, *face.table(collected.records))]


def compare_searchlight(options: Namespace, chosen: list["Engine"], output: OutputFolder, terminal: Terminal) -> Found:
    """Compare where a narrow beam's light leaves a slab with Burley and the dipole."""
    from true_diffuse.addon.probe.environment import environment
    from true_diffuse.scripts.studies import searchlight
    from true_diffuse.scripts.studies.study import run

    if options.save_blend:
        raise BadInput("--scene searchlight has no scene to save: it is built anew for every ring")
    samples = {engine.key: options.samples or SCENES["searchlight"].samples[engine.key] for engine in chosen}
    steps = searchlight.steps(chosen, samples)
    with terminal.progress(len(steps)) as progress:
        records = list(run(steps, progress))
    output.write_text("searchlight.svg", searchlight.svg(records, *options.resolution))
    table = "Where a narrow beam's light leaves the slab, R [1 / mfp^2]", *searchlight.table(records)
    return {"records": records, "environment": environment(chosen)}, [table]


def _render(
    of: "type[Renderer[Any]]",
    chosen: list["Engine"],
    choices: Mapping[str, "Choice"],
    options: Namespace,
    output: OutputFolder,
    terminal: Terminal,
    then: "Callable[[Any, WorkItem], None]" = lambda _renderer, _item: None,
) -> "Collected":
    """Render what the options ask for by a renderer `of` the scene; return what it comes to, pictures in `output`.

    `then` is given the renderer, and the first item of each chunk, once that is done.
    """
    from true_diffuse.scripts.studies import pictures
    from true_diffuse.scripts.studies.comparison.base import Collected
    from true_diffuse.scripts.studies.comparison.outcomes import Outcomes

    spec, _ = job_spec(options, [engine.key for engine in chosen], choices)
    renderer, collected, chunks = of(spec, chosen), Collected(), list(spec.chunks())
    with terminal.progress(sum(spec.work(item) for chunk in chunks for item in chunk)) as progress:
        for chunk in chunks:
            outcomes = Outcomes()
            renderer.do(chunk, outcomes, progress)
            renderer.collect(chunk, outcomes, output.folder, collected)
            then(renderer, chunk[0])
    renderer.finish()
    for note in collected.notes:
        terminal.say(f"{note['character']}: {note['text']}")
    if options.save_blend and renderer.scene:
        pictures.save_blend(renderer.scene, output.folder / f"{options.scene}.blend")
    return collected


def _write_viewer(renderer: "five.Renderer", item: "WorkItem", output: OutputFolder, terminal: Terminal) -> None:
    """Stage the page of a character, as it is at an item's frame; say what is not in it, and its size where that is large."""
    from true_diffuse.scripts.studies.comparison.base import one_line
    from true_diffuse.scripts.viewer import page

    renderer.show(item.frame)
    name = f"{renderer.spec.prefix(replace(item, frame=None))}viewer.html"
    if renderer.stage.converted:
        terminal.say(f"Baking colors for {name}")
    with one_line(name):
        text, notes = page.html(renderer.stage, item.character, renderer.spec.albedo)
    for note in notes:
        terminal.say(f"{name}: {note}")
    output.write_text(name, text)
    if len(text) > LARGE_PAGE:
        terminal.say(f"{name} has {len(text) / 1e6:.1f} MB")


def _pick(options: Namespace, chosen: list["Engine"], terminal: Terminal) -> dict[str, "Choice"]:
    """Return quality and samples for each engine by its key, having said what they are; nothing where no error was asked for."""
    from true_diffuse.addon.probe import tolerance
    from true_diffuse.addon.probe.environment import environment

    if options.error is None or options.report is None:
        return {}
    try:
        report = tolerance.read_report(options.report, environment([]))
        roughest = max(options.sigmas)
        choices = {
            engine.key: tolerance.choose(report, "five", engine.key, "Oren-Nayar", options.error, roughness=roughest)
            for engine in chosen
        }
    except tolerance.ToleranceError as error:
        raise BadInput(str(error)) from error
    except (AttributeError, KeyError, TypeError) as error:
        raise BadInput(f"the report {options.report} is damaged") from error
    for choice in choices.values():
        terminal.say(f"For {tolerance.percent(options.error)} {tolerance.describe(choice)}")
    terminal.say("Standard specular stays as it is and does not count")
    return choices


def _reached(
    options: Namespace, choices: Mapping[str, "Choice"], records: list["Record"], terminal: Terminal
) -> dict[str, dict[str, object]]:
    """Return what was picked and what came of it, by engine, and say so: the largest error of the rough characters."""
    from true_diffuse.addon.measure.record import LABELS
    from true_diffuse.addon.probe.tolerance import percent

    found = {}
    for key, choice in choices.items():
        errors = [record["rms_error"] for record in records if record["engine"] == key and record["model"] != "Specular"]
        measured = max((error for error in errors if error is not None), default=None)
        met = None if measured is None or options.error is None else measured <= options.error
        found[key] = {"asked": options.error, **asdict(choice), "measured_error": measured, "met": met}
        if measured is not None:
            verdict = "as asked" if met else "more than asked"
            terminal.say(f"{LABELS[key]}: {percent(measured)} from the models measured under the key light, {verdict}")
    return found


SCENES = {
    "five": Scene(
        compare=compare_five,
        resolution=(1280, 480),
        samples={"eevee": 16, "cycles": 32, "realtime": 16},
        options={
            "characters": ["human"],
            "frames": None,
            "sigmas": (0.0, 0.2, 0.33),
            "albedo": 0.8,
            "full_figure": False,
            "plaster": False,
            "web": False,
            "error": None,
            "job": None,
        },
    ),
    "face": Scene(
        compare=compare_face,
        resolution=(1200, 480),
        samples={"eevee": 32, "cycles": 20, "realtime": 32},
        options={"characters": ["human"], "job": None},
    ),
    "searchlight": Scene(
        compare=compare_searchlight,
        resolution=(900, 560),
        samples={"eevee": 16, "cycles": 1024},
        options={},
    ),
}


def vars_of(options: Namespace) -> dict[str, object]:
    """Return the options as they are kept in compare.json; those that the scene has not are left out."""
    known = {name: value for name, value in vars(options).items() if value is not None or name == "samples"}
    return {name: str(value) if isinstance(value, Path) else value for name, value in known.items()}


if __name__ == "__main__":
    end(main())
