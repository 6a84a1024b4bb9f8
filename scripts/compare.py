# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders the paper's five characters in EEVEE and Cycles and measures every pixel against the analytic models.

uv run scripts/compare.py [OPTIONS]
blender -b --python scripts/compare.py -- [OPTIONS]
"""

import math
import sys
from argparse import ArgumentTypeError
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from console import BadInput, Parser, Terminal, script_arguments
from frame import ENGINE_KEYS, engine_list, run_script, sample_count, start_blender
from outputs import Staging

SAMPLES = {"eevee": 16, "cycles": 32}


@dataclass(frozen=True)
class Options:
    """What the user asked for; `samples` is None for each engine's default."""

    engines: tuple[str, ...]
    resolution: tuple[int, int]
    samples: int | None
    character: str
    sigmas: tuple[float, ...]
    albedo: float
    full_figure: bool
    out: Path
    save_blend: bool


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
    parser.add_argument("--resolution", type=_resolution, default=(1280, 480), metavar="WxH", help="pixels (default: 1280x480)")
    parser.add_argument(
        "--samples",
        type=sample_count,
        metavar="N",
        help=f"samples per pixel (default: {SAMPLES['eevee']} in EEVEE, {SAMPLES['cycles']} in Cycles)",
    )
    parser.add_argument(
        "--character",
        default="human",
        metavar="WHO",
        help="human, monkey, or a .blend, .usd, .usda, .usdc, .usdz, .glb, .gltf or .obj file (default: human)",
    )
    parser.add_argument(
        "--sigma", type=_sigmas, default=(0.0, 0.2, 0.33), metavar="LIST", help="facet slopes in radians (default: 0,0.2,0.33)"
    )
    parser.add_argument("--albedo", type=_albedo, default=0.8, metavar="RHO", help="of the lightest paint, 0 to 1 (default: 0.8)")
    parser.add_argument("--full-figure", action="store_true", help="show the human from head to toe instead of as a bust")
    parser.add_argument("--out", type=Path, default=Path("comparison"), metavar="DIR", help="folder to write (default: comparison)")
    parser.add_argument("--save-blend", action="store_true", help="also write five.blend, the scene to open in Blender")
    got = parser.parse_args(arguments)
    return Options(
        engines=got.engine,
        resolution=got.resolution,
        samples=got.samples,
        character=got.character,
        sigmas=got.sigma,
        albedo=got.albedo,
        full_figure=got.full_figure,
        out=got.out,
        save_blend=got.save_blend,
    )


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
    chosen = start_blender(options.engines, terminal)
    from true_diffuse.addon import comparison
    from true_diffuse.scenes import character, five_characters

    try:
        mesh = character.load(options.character)
    except character.CharacterError as error:
        raise BadInput(str(error)) from error
    bust = options.character == "human" and not options.full_figure
    stage = five_characters.build(mesh, options.albedo, bust, options.resolution, options.sigmas)

    folder = staging.folder
    with terminal.progress(comparison.work(stage, len(chosen))) as progress:
        seen = comparison.surfaces(stage, progress)
        measured = []
        for engine in chosen:
            samples = options.samples or SAMPLES[engine.key]
            comparison.render_picture(stage, engine, samples, folder, progress)
            measured += comparison.measure(stage, seen, engine, samples, progress)
    comparison.write_error_maps(stage, measured, folder)
    records = [comparison.record(one, options.albedo) for one in measured]
    document = {"records": records, "environment": comparison.environment(chosen), "options": vars_of(options)}
    staging.write_json("compare.json", document)
    if options.save_blend:
        comparison.save_blend(stage, folder / "five.blend")
    written = staging.publish()
    terminal.table("Error against the analytic model, key light alone", *comparison.table(records))
    terminal.say(f"Wrote {', '.join(written)} to {options.out}")


def vars_of(options: Options) -> dict[str, object]:
    """Return the options as they are kept in compare.json."""
    return {name: str(value) if isinstance(value, Path) else value for name, value in asdict(options).items()}


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
