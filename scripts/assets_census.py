# SPDX-License-Identifier: GPL-3.0-or-later
"""Counts what becomes of the materials of all assets in a folder: converted, drawn by Realtime, exported to USD and glTF.

uv run scripts/assets_census.py FOLDER [OPTIONS]
blender -b --python scripts/assets_census.py -- FOLDER [OPTIONS]

Each asset is imported with Blender's own importers, in a process of its own, so that one that crashes or hangs ends nothing else.
What a material has is read from Blender's nodes by a walk of its own, and held against what is in the written files and against
what Blender's own export of the unconverted material holds. Scripts in .blend files do not run.
"""

import json
import os
import subprocess
import sys
import tempfile
import threading
import time
from argparse import SUPPRESS, ArgumentTypeError, Namespace
from concurrent.futures import ThreadPoolExecutor, as_completed
from functools import partial
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.inputs import number
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import load_bpy, run_script

KINDS = (".blend", ".glb", ".gltf", ".usd", ".usda", ".usdc", ".usdz")
OUT = Path("census")
SECONDS = 180.0
SIZE = 64
SHOWN_LOST = 20  # lines in the terminal


def main() -> int:
    """Run the script; returns the exit status."""
    options = parse(script_arguments())
    if options.asset:
        return examine(options)
    return run_script("assets_census.py", options.out, partial(census, options))


def parse(arguments: list[str]) -> Namespace:
    """Return the options; ends the process with one line and status 2 where they make no sense."""
    parser = Parser(prog="assets_census.py", description=(__doc__ or "").splitlines()[0])
    add = parser.add_argument
    add("folder", type=_folder, nargs="?", metavar="FOLDER", help=f"folder of assets ({', '.join(KINDS)}), and all folders in it")
    add("--match", default="**/*", metavar="PATTERN", help="only files that match, as 'robots/**/*.glb' (default: all)")
    add("--limit", type=number(int, 1, 1_000_000), metavar="N", help="at most so many files, evenly chosen")
    add("--seconds", type=number(float, 1.0, 86400.0), default=SECONDS, metavar="S", help=f"for one asset (default: {SECONDS:.0f})")
    add("--processes", type=number(int, 1, 256), default=1, metavar="N", help="assets at a time (default: 1)")
    text = f"pixels a side of the pictures that compare Cycles and Realtime; 0 for none (default: {SIZE})"
    add("--resolution", type=number(int, 0, 4096), default=SIZE, metavar="N", help=text)
    add("--json", action="store_true", help="print the figures as JSON in place of tables")
    add("--out", type=Path, default=OUT, metavar="DIR", help=f"folder to write census.json to (default: {OUT})")
    add("--asset", type=Path, help=SUPPRESS)  # the process of one asset: what to examine
    add("--record", type=Path, help=SUPPRESS)  # where to write its record
    add("--realtime", action="store_true", help=SUPPRESS)  # and whether Realtime runs here
    options = parser.parse_args(arguments)
    if options.folder is None and options.asset is None:
        parser.error("the following arguments are required: FOLDER")
    return options


def _folder(text: str) -> Path:
    path = Path(text)
    if not path.is_dir():
        raise ArgumentTypeError(f"{text} is not a folder")
    return path


def census(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Examine all assets, and write and show the figures."""
    from true_diffuse.scripts.census import table

    files = find(options.folder, options.match, options.limit)
    given = ["--resolution", str(options.resolution)]
    if options.resolution:
        terminal.say("Loading Blender")
        load_bpy()
        from true_diffuse.addon.blender import engines

        if engines.eevee_runs_here():
            given.append("--realtime")
        else:
            terminal.say("Realtime finds no graphics driver here and is left out")
    records: list[dict[str, Any]] = []
    errors: list[dict[str, str]] = []
    with (
        terminal.progress(len(files)) as progress,
        ThreadPoolExecutor(options.processes) as pool,
        tempfile.TemporaryDirectory() as work,
    ):
        tasks = {pool.submit(run, file, Path(work, str(index)), options.seconds, given): file for index, file in enumerate(files)}
        for task in as_completed(tasks):
            name = str(tasks[task].relative_to(options.folder))
            with progress.step(name, 1.0):
                record = task.result()
            if "error" in record:
                errors.append({"file": name, "error": record["error"]})
                if not options.json:
                    terminal.say(f"{name}: {record['error']}")
            else:
                records.append({"file": name, **record})
    records.sort(key=lambda record: record["file"])
    document = {
        "features": table.features(records),
        "shares": table.shares(records),
        "pictures": table.pictures(records),
        "errors": sorted(errors, key=lambda error: error["file"]),
    }
    output.write_json("census.json", {**document, "assets": records})
    written = output.publish()
    if options.json:
        terminal.say(json.dumps(document, indent=2))
        return
    for each in table.tables(records):
        terminal.table(*each)
    for record in records:
        for target, trace in record["failures"].items():
            terminal.say(f"{record['file']}: {table.TARGETS[target]} failed: {trace.splitlines()[-1]}")
    lost = list(table.faults(records))
    if lost:
        terminal.say(f"\nLost unsaid, or poorer than Blender's own export: {len(lost)}, all of them in census.json")
        for file, material, target, what, expected, held in lost[:SHOWN_LOST]:
            terminal.say(f"  {file}: {material}: {target}: {what}: {expected}, there is {held}")
    terminal.say(f"\n{len(records)} assets, {len(errors)} without a record. Wrote {', '.join(written)} to {options.out}")


def find(folder: Path, pattern: str, limit: int | None) -> list[Path]:
    """Return the assets in a folder, in order. Raises BadInput where there are none."""
    try:
        files = sorted(path for path in folder.glob(pattern) if path.suffix.lower() in KINDS and path.is_file())
    except (ValueError, NotImplementedError) as error:
        raise BadInput(f"{pattern!r} is no pattern of files in a folder: {error}") from error
    if not files:
        raise BadInput(f"{folder} holds no file of a known kind ({', '.join(KINDS)}) that matches {pattern}")
    count = min(limit or len(files), len(files))
    return [files[index * len(files) // count] for index in range(count)]


def run(file: Path, work: Path, seconds: float, given: list[str]) -> dict[str, Any]:
    """Return the record of one asset from a process of its own with options `given`, or the "error" it ended with, in one line."""
    work.mkdir()
    record, log = work / "record.json", work / "log.txt"
    own = ["--asset", str(file.resolve()), "--record", str(record)]
    start = time.monotonic()
    with log.open("wb") as stream:
        # The process ends when its input does, however this one ends.
        process = subprocess.Popen(
            [*interpreter(), *own, *given],
            stdin=subprocess.PIPE,
            stdout=stream,
            stderr=stream,
            cwd=work,
            env=os.environ | {"TMPDIR": str(work)},
        )
        try:
            status = process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            return {"error": f"took longer than {seconds:.0f} s"}
    if record.is_file():
        return {"seconds": round(time.monotonic() - start, 1), **json.loads(record.read_bytes())}
    lines = [line for line in log.read_text(errors="replace").splitlines() if line.strip()]
    return {"error": f"Blender ended with status {status}: {lines[-1].strip() if lines else 'it said nothing'}"}


def interpreter() -> list[str]:
    """Return the command that runs this script."""
    script = str(Path(__file__).resolve())
    if sys.argv[0].endswith(".py"):
        return [sys.executable, script]
    import bpy

    return [bpy.app.binary_path, "--background", "--factory-startup", "--python", script, "--"]


def examine(options: Namespace) -> int:
    """Write the record of one asset, and end the process."""
    threading.Thread(target=_end_with_input, daemon=True).start()
    load_bpy()
    from true_diffuse.scripts.census import asset

    try:
        found = asset.examine(options.asset, options.record.parent, options.resolution, options.realtime)
    except Exception as error:  # whatever an asset does to Blender or to us is a line of the census
        import traceback

        traceback.print_exc()
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = "" if isinstance(error, asset.AssetError) else f" ({Path(place.filename).name}:{place.lineno})"
        text = " ".join(str(error).split()) or type(error).__name__
        found = {"error": text + where, "trace": traceback.format_exc()}
    whole = options.record.with_suffix(".whole")
    whole.write_text(json.dumps(found), encoding="utf-8")
    whole.replace(options.record)
    os._exit(0)  # Blender may crash while it ends


def _end_with_input() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    end(main())
