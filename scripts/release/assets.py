# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes the asset library, as the button in the extension's preferences does, into a folder to look at or to hand on.

uv run scripts/release/assets.py                   writes dist/true_diffuse_assets; seconds
blender -b --python scripts/release/assets.py
"""

import sys
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import empty_file, run_script

FOLDER = Path(__file__).resolve().parents[2] / "dist" / "true_diffuse_assets"


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="assets.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="DIR", help="folder (default: dist/true_diffuse_assets)")
    options = parser.parse_args(script_arguments())
    return run_script("assets.py", options.out, partial(library, options.out))


def library(out: Path, output: OutputFolder, terminal: Terminal) -> None:
    """Write the library into `output`, then publish it."""
    terminal.say("Loading Blender")
    from true_diffuse.addon.material import assets

    empty_file()
    assets.write(output.folder)
    written = output.publish()
    size = sum((out / name).stat().st_size for name in written)
    terminal.say(f"Wrote {', '.join(written)}, {size / 1000.0:.0f} kB, to {out}")


if __name__ == "__main__":
    end(main())
