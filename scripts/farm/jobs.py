# SPDX-License-Identifier: GPL-3.0-or-later
"""What the jobs of compare.py and report.py share: writing their bundle, and which work items a task chooses. No bpy."""

import sys
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from true_diffuse.scripts.cli import inputs
from true_diffuse.scripts.cli.console import BadInput, Terminal
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.farm import bundle
from true_diffuse.scripts.studies.comparison.outcomes import WorkError

COLLECT = "Merge the records, build the pictures and the report; name what is missing or damaged"


def write_job(
    name: str,
    description: str,
    document: Mapping[str, Any],
    steps: Sequence[bundle.Step],
    target: tuple[Path, Path | None],
    output: OutputFolder,
    terminal: Terminal,
) -> None:
    """Write the bundle of a job, and say how to run it. `target` is its folder and, where one is asked for, that of the results."""
    import bpy

    folder, results = target
    if [path for path in folder.iterdir() if path.resolve() != output.folder]:
        raise BadInput(f"job folder {folder} exists and is not empty")
    files = [who for who in document["spec"]["characters"].values() if Path(who).is_absolute()]
    awaited = {name for step in steps for name in step.after}
    collect = bundle.Step("collect", "collect", COLLECT, after=[step.name for step in steps if step.name not in awaited])
    # binary_path is "" where Blender is Python's module bpy
    job = bundle.Job(name, description, document, [*steps, collect], files, sys.executable, bpy.app.binary_path)
    try:
        bundle.write(job, output.folder, results.absolute() if results else None)
    except OSError as error:
        raise BadInput(f"cannot write to job folder {folder}: {error.strerror}") from error
    output.publish()
    given = f" -p OutputDir={results.absolute()}" if results else ""
    terminal.say(f"Wrote the job to {folder}. To run it here: openjd run {folder / 'template.json'}{given}")


def one_of(name: str, values: Iterable[str]) -> dict[str, Any]:
    """Return a task parameter that takes each of `values`."""
    return {"name": name, "type": "STRING", "range": list(values)}


def character_range(count: int) -> dict[str, Any]:
    """Return a task parameter that takes each of `count` characters by its place."""
    return {"name": "Character", "type": "INT", "range": f"0-{count - 1}"}


def chosen[Item](items: Iterable[Item], characters: Iterable[str], given: Mapping[str, str]) -> list[Item]:
    """Return the work items that a task's parameters choose; raises WorkError where these make no sense."""
    wanted: dict[str, Any] = dict(given)
    try:
        if "character" in given:
            wanted["character"] = [list(characters)[int(given["character"])]]
        if "frame" in given:
            wanted["frame"] = inputs.frame_numbers(given["frame"])
    except (ValueError, IndexError) as error:
        raise WorkError(f"no such task: {error}") from error

    def fits(item: Item) -> bool:
        for name, value in wanted.items():
            own = getattr(item, name, None)
            if own not in value if name in ("character", "frame") else str(own) != value:
                return False
        return True

    return [item for item in items if fits(item)]


def check_any(items: Sequence[object], given: Mapping[str, str]) -> None:
    """Raise WorkError where no item was chosen."""
    if not items:
        raise WorkError(f"no such task: {', '.join(f'{name} {value}' for name, value in given.items())}")
