# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures how near each home of each model comes to its formula, on a sphere under a sun.

uv run scripts/accuracy.py --only rough --out accuracy.json
"""

import sys
from argparse import Namespace
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from console import Parser, Terminal, script_arguments
from frame import ENGINE_KEYS, engine_list, run_script, sample_count, start_blender
from outputs import Staging

SIZE = 96  # pixels across the sphere: 5000 to compare


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="accuracy.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--only", choices=("rough",), default="rough", help="what to measure (default: rough)")
    parser.add_argument("--engine", type=engine_list, default=ENGINE_KEYS, metavar="LIST", help="default: eevee,cycles")
    parser.add_argument("--samples", type=sample_count, default=4, metavar="N", help="per pixel (default: 4)")
    parser.add_argument("--quick", action="store_true", help="three angles of the light instead of five")
    parser.add_argument("--out", type=Path, default=Path("accuracy.json"), metavar="FILE", help="default: accuracy.json")
    options = parser.parse_args(script_arguments())
    if options.out.is_dir():
        parser.error(f"{options.out} is a folder")
    return run_script(parser.prog, options.out.parent, partial(measure, options))


def measure(options: Namespace, staging: Staging, terminal: Terminal) -> None:
    """Render, measure and write the records."""
    engines = start_blender(options.engine, terminal)
    from true_diffuse.addon import accuracy, comparison
    from true_diffuse.scenes.sphere import sphere_under_sun

    degrees = accuracy.QUICK_LIGHT_DEGREES if options.quick else accuracy.LIGHT_DEGREES
    with terminal.progress(accuracy.work(engines, degrees)) as progress:
        records = list(accuracy.rough(sphere_under_sun(SIZE), engines, degrees, options.samples, progress))
    document = {"records": records, "environment": comparison.environment(engines)}
    staging.write_json(options.out.name, document)
    staging.publish()
    terminal.table("RMS error against equation (1), light at the angle from the viewer", *accuracy.table(records))
    terminal.say(f"Wrote {options.out}")


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
