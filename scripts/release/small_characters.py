# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the eight small characters that tests convert, draw and export.

uv run scripts/release/small_characters.py [OPTIONS]
blender -b --python scripts/release/small_characters.py -- [OPTIONS]
"""

import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.characters.small.characters import GLTF_FILES
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import load_bpy, run_script

FOLDER = Path(__file__).resolve().parents[2] / "tests" / "assets"


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="small_characters.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="DIR", help="folder to write (default: tests/assets)")
    options = parser.parse_args(script_arguments())
    return run_script("small_characters.py", options.out, partial(write, options.out))


def write(out: Path, output: OutputFolder, terminal: Terminal) -> None:
    """Build the files in `output`, then publish them."""
    load_bpy()
    from true_diffuse.scripts.characters.small import skin

    for name, build in GLTF_FILES.items():
        (output.folder / name).write_bytes(build())
    skin.write(output.folder / skin.FILE)
    written = output.publish()
    size = sum((out / name).stat().st_size for name in written)
    terminal.say(f"Wrote {len(written)} characters, {size / 1000.0:.0f} kB, to {out}")


if __name__ == "__main__":
    end(main())
