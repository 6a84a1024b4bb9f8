# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the paper's figures in EEVEE and Cycles and measures every pixel.

Five characters against the analytic models; a face, with and without subsurface scattering, in one engine against the other; where
a narrow beam's light leaves a slab, against Burley and the dipole.

uv run scripts/compare.py [OPTIONS]
blender -b --python scripts/compare.py -- [OPTIONS]
"""

import math
import sys
from argparse import ArgumentTypeError
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

from console import BadInput, Parser, Terminal, script_arguments
from frame import ENGINE_KEYS, engine_list, load_character, run_script, sample_count, start_blender
from outputs import Staging

if TYPE_CHECKING:
    from true_diffuse.addon.engines import Engine


@dataclass(frozen=True)
class Options:
    """What the user asked for; `samples` is None for each engine's default."""

    scene: str
    engines: tuple[str, ...]
    resolution: tuple[int, int]
    samples: int | None
    character: str
    sigmas: tuple[float, ...]
    albedo: float
    full_figure: bool
    out: Path
    save_blend: bool


@dataclass(frozen=True)
class Scene:
    """What can be compared: how, the defaults, and which of the options that not every scene has it knows."""

    compare: Callable[[Options, list["Engine"], Staging, Terminal], list[str]]
    resolution: tuple[int, int]
    samples: Mapping[str, int]
    knows: Mapping[str, object]  # by name, with defaults


def main() -> int:
    """Run the script; returns the exit status."""
    options = parse(script_arguments())
    return run_script("compare.py", options.out, partial(compare, options))


def parse(arguments: list[str]) -> Options:
    """Return the options; ends the process with one line and status 2 where they make no sense."""
    parser = Parser(prog="compare.py", description=__doc__.splitlines()[0])
    parser.add_argument(
        "--engine", type=engine_list, default=ENGINE_KEYS, metavar="LIST", help="engines, comma separated (default: eevee,cycles)"
    )
    parser.add_argument("--scene", choices=SCENES, default="five", help="what to compare (default: five)")
    parser.add_argument("--resolution", type=_resolution, metavar="WxH", help=f"pixels (default: {_defaults(_size)})")
    parser.add_argument("--samples", type=sample_count, metavar="N", help=f"samples per pixel (default: {_defaults(_samples)})")
    parser.add_argument(
        "--character",
        metavar="WHO",
        help="human, monkey, or a .blend, .usd, .usda, .usdc, .usdz, .glb, .gltf or .obj file (default: human)",
    )
    parser.add_argument("--sigma", type=_sigmas, metavar="LIST", help="five: facet slopes in radians (default: 0,0.2,0.33)")
    parser.add_argument("--albedo", type=_albedo, metavar="RHO", help="five: of the lightest paint, 0 to 1 (default: 0.8)")
    parser.add_argument(
        "--full-figure", action="store_const", const=True, help="five: show the human from head to toe instead of as a bust"
    )
    parser.add_argument("--out", type=Path, default=Path("comparison"), metavar="DIR", help="folder to write (default: comparison)")
    parser.add_argument("--save-blend", action="store_true", help="also write SCENE.blend, the scene to open in Blender")
    got = parser.parse_args(arguments)
    scene = SCENES[got.scene]
    special = {"character": got.character, "sigma": got.sigma, "albedo": got.albedo, "full_figure": got.full_figure}
    for name, value in special.items():
        if value is not None and name not in scene.knows:
            parser.error(f"--scene {got.scene} has no option --{name.replace('_', '-')}")
        special[name] = scene.knows.get(name) if value is None else value
    return Options(
        scene=got.scene,
        engines=got.engine,
        resolution=got.resolution or scene.resolution,
        samples=got.samples,
        character=special["character"],
        sigmas=special["sigma"],
        albedo=special["albedo"],
        full_figure=special["full_figure"],
        out=got.out,
        save_blend=got.save_blend,
    )


def _size(scene: Scene) -> str:
    return "{}x{}".format(*scene.resolution)


def _samples(scene: Scene) -> str:
    return f"{scene.samples['eevee']} in EEVEE, {scene.samples['cycles']} in Cycles"


def _defaults(show: Callable[[Scene], str]) -> str:
    """Return what `show` says of each scene, for the help."""
    return "; ".join(f"{name}: {show(scene)}" for name, scene in SCENES.items())


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise ArgumentTypeError(f"{text!r} is not a number") from None


def _resolution(text: str) -> tuple[int, int]:
    width, _, height = text.lower().partition("x")
    if not (width.isdecimal() and height.isdecimal()):
        raise ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT in pixels")
    size = int(width), int(height)
    if not all(16 <= side <= 16384 for side in size):
        raise ArgumentTypeError(f"{text!r}: each side must be 16 to 16384 pixels")
    return size


def _sigmas(text: str) -> tuple[float, ...]:
    values = tuple(dict.fromkeys(abs(value) if value == 0.0 else value for value in map(_number, text.split(","))))
    for value in values:
        if not 0.0 <= value <= math.pi / 2:
            raise ArgumentTypeError(f"sigma must be 0 to pi/2 radians, not {value:g}")
    if len(values) > 8:
        raise ArgumentTypeError(f"at most 8 sigmas fit in the picture, not {len(values)}")
    return values


def _albedo(text: str) -> float:
    value = _number(text)
    if not 0.0 <= value <= 1.0:
        raise ArgumentTypeError(f"albedo must be 0 to 1, not {value:g}")
    return value


def compare(options: Options, staging: Staging, terminal: Terminal) -> None:
    """Render, measure and write everything into `staging`, then publish it."""
    written = SCENES[options.scene].compare(options, start_blender(options.engines, terminal), staging, terminal)
    terminal.say(f"Wrote {', '.join(written)} to {options.out}")


def publish(options: Options, chosen: list["Engine"], staging: Staging, found: dict[str, object]) -> list[str]:
    """Write what was `found` with the machine and the options as compare.json, publish all files and return their names."""
    from true_diffuse.addon.studies.environment import environment

    staging.write_json("compare.json", {**found, "environment": environment(chosen), "options": vars_of(options)})
    return staging.publish()


def _samples_of(options: Options, engine: "Engine") -> int:
    return options.samples or SCENES[options.scene].samples[engine.key]


def compare_five(options: Options, chosen: list["Engine"], staging: Staging, terminal: Terminal) -> list[str]:
    """Compare the five characters with the analytic models."""
    from true_diffuse.addon.studies import five, pictures
    from true_diffuse.scenes import five_characters

    mesh = load_character(options.character)
    bust = options.character == "human" and not options.full_figure
    stage = five_characters.build(mesh, options.albedo, bust, options.resolution, options.sigmas)

    folder = staging.folder
    captions = five.five_captions(stage)
    with terminal.progress(five.work(stage, len(chosen))) as progress:
        seen = five.surfaces(stage, progress)
        measured = []
        for engine in chosen:
            samples = _samples_of(options, engine)
            pictures.render_picture(stage.scene, engine, samples, folder / "five", captions, progress)
            measured += five.measure(stage, seen, engine, samples, progress)
    five.write_error_maps(stage, measured, folder)
    records = [five.record(one, options.albedo) for one in measured]
    if options.save_blend:
        pictures.save_blend(stage.scene, folder / "five.blend")
    written = publish(options, chosen, staging, {"records": records})
    terminal.table("Error against the analytic model, key light alone", *five.table(records))
    return written


def compare_face(options: Options, chosen: list["Engine"], staging: Staging, terminal: Terminal) -> list[str]:
    """Compare one engine's head with BRDF, BSSRDF and the mixed model with the other's, region by region."""
    from true_diffuse.addon.studies import face as study
    from true_diffuse.addon.studies import pictures
    from true_diffuse.scenes import face

    stage = face.build(load_character(options.character), options.character == "human", options.resolution)
    folder = staging.folder
    captions = study.captions(stage)
    rendered, measured = [], []
    with terminal.progress(study.work(stage, chosen)) as progress:
        seen = study.surfaces(stage, progress)
        for engine in chosen:
            samples = _samples_of(options, engine)
            denoise = engine.key == "cycles"
            seconds = pictures.render_picture(stage.scene, engine, samples, folder / "face", captions, progress, denoise)
            rendered.append({"engine": engine.key, "samples": samples, "denoised": denoise, "render_seconds": seconds})
            measured += study.measure(stage, engine, samples, progress)
    records = study.records(seen, measured)
    if options.save_blend:
        pictures.save_blend(stage.scene, folder / "face.blend")
    written = publish(options, chosen, staging, {"records": records, "pictures": rendered})
    terminal.table("EEVEE against Cycles on skin, key and back light alone", *study.table(records))
    return written


def compare_searchlight(options: Options, chosen: list["Engine"], staging: Staging, terminal: Terminal) -> list[str]:
    """Compare where a narrow beam's light leaves a slab with Burley and the dipole."""
    from true_diffuse.addon.studies import searchlight

    if options.save_blend:
        raise BadInput("--scene searchlight has no scene to save: it is built anew for every ring")
    samples = {engine.key: _samples_of(options, engine) for engine in chosen}
    with terminal.progress(searchlight.work(chosen)) as progress:
        records = list(searchlight.records(chosen, samples, progress))
    staging.write_text("searchlight.svg", searchlight.svg(records, *options.resolution))
    written = publish(options, chosen, staging, {"records": records})
    terminal.table("Where a narrow beam's light leaves the slab, R [1 / mfp^2]", *searchlight.table(records))
    return written


SCENES = {
    "five": Scene(
        compare=compare_five,
        resolution=(1280, 480),
        samples={"eevee": 16, "cycles": 32},
        knows={"character": "human", "sigma": (0.0, 0.2, 0.33), "albedo": 0.8, "full_figure": False},
    ),
    "face": Scene(
        compare=compare_face,
        resolution=(1200, 480),
        samples={"eevee": 32, "cycles": 20},
        knows={"character": "human"},
    ),
    "searchlight": Scene(
        compare=compare_searchlight,
        resolution=(900, 560),
        samples={"eevee": 16, "cycles": 1024},
        knows={},
    ),
}


def vars_of(options: Options) -> dict[str, object]:
    """Return the options as they are kept in compare.json; those that the scene has not are left out."""
    known = {name: value for name, value in asdict(options).items() if value is not None or name == "samples"}
    return {name: str(value) if isinstance(value, Path) else value for name, value in known.items()}


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
