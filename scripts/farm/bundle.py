# SPDX-License-Identifier: GPL-3.0-or-later
"""A job bundle of Open Job Description, in the layout that AWS Deadline Cloud reads, as JSON.

https://github.com/OpenJobDescription/openjd-specifications (2023-09). The bundle carries the code that its tasks run, so that it
needs nothing of the checkout and gives the same figures while that goes on. A session's environment keeps one Blender alive.
"""

import hashlib
import json
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from true_diffuse.scripts.cli.console import BadInput, Terminal
from true_diffuse.scripts.cli.outputs import OutputFolder

ROOT = Path(__file__).resolve().parents[2]
CODE = ("__init__.py", "blender_manifest.toml", "addon", "scenes", "scripts", "shaders")
SUFFIXES = (".py", ".toml", ".json", ".glsl", ".osl", ".blend")
JOB = "job.json"  # the study and its JobSpec
BEGIN_SECONDS, END_SECONDS = 600, 60
COLLECT = "Merge the records, build the pictures and the report; name what is missing or damaged"

type Parameter = Mapping[str, Any]
"""A parameter that a step has a task for each value of, as templates have it."""


@dataclass(frozen=True)
class Step:
    """A step of a job: a task for each combination of its `parameters`, as `combination` says or all with all.

    It is what scripts/task.py does by `command` with the arguments `fixed`, once the steps `after` are done.
    """

    name: str
    command: str
    description: str
    parameters: Sequence[Parameter] = ()
    combination: str = ""
    fixed: Sequence[str] = ()
    after: Sequence[str] = ()


def one_of(name: str, values: Iterable[str]) -> Parameter:
    """Return a task parameter that takes each of `values`."""
    return {"name": name, "type": "STRING", "range": list(values)}


def character_range(count: int) -> Parameter:
    """Return a task parameter that takes each of `count` characters by its place."""
    return {"name": "Character", "type": "INT", "range": f"0-{count - 1}"}


def write(
    name: str,
    description: str,
    document: Mapping[str, Any],
    steps: Sequence[Step],
    files: Sequence[Path],
    results: Path | None,
    output: OutputFolder,
    terminal: Terminal,
) -> None:
    """Write the bundle of the job `document`, with a step that collects after the others, and say how to run it.

    `files` are those of the characters and all that they need. Results go to the folder `results`, or where None is given to the
    bundle's own. Raises BadInput where the bundle's folder holds something or cannot be written.
    """
    import bpy

    folder = output.target
    if output.others():
        raise BadInput(f"job folder {folder} exists and is not empty")
    results = results and results.absolute()
    blender = _text("Blender", bpy.app.binary_path, "Blender to render with; nothing for the module bpy of Python")  # which has ""
    awaited = {name for step in steps for name in step.after}
    collect = Step("collect", "collect", COLLECT, after=[step.name for step in steps if step.name not in awaited])
    chunked = any(one["type"] == "CHUNK[INT]" for step in steps for one in step.parameters)
    template = {
        "specificationVersion": "jobtemplate-2023-09",
        **({"extensions": ["TASK_CHUNKING"]} if chunked else {}),
        "name": name,
        "description": description,
        "parameterDefinitions": [
            _path("JobDir", "IN", ".", "This bundle"),
            _path("OutputDir", "OUT", "output", "Where results go"),
            _text("Python", sys.executable, "Python 3.13 that runs the tasks"),
            blender,
        ],
        "jobEnvironments": [
            {
                "name": "Blender",
                "description": "One Blender for all tasks of a session: started once, a scene built once for all its tasks",
                "script": {
                    "actions": {
                        "onEnter": {**_action("begin"), "timeout": BEGIN_SECONDS},
                        "onExit": {**_action("end"), "timeout": END_SECONDS},
                    }
                },
            }
        ],
        "steps": [_step(step) for step in (*steps, collect)],
    }
    values = [{"name": "OutputDir", "value": str(results)}] if results else []
    assets = {
        "inputs": {"filenames": [str(file) for file in files], "directories": []},
        "outputs": {"directories": [str(results)] if results else []},
        "referencedPaths": [],
    }
    try:
        _write(output.folder / "template.json", template)
        _write(output.folder / "parameter_values.json", {"parameterValues": values})
        _write(output.folder / "asset_references.json", {"assetReferences": assets})
        # results of another version of the code are those of another job
        _write(output.folder / JOB, {**document, "code": _copy_code(output.folder / "true_diffuse")})
    except OSError as error:
        raise BadInput(f"cannot write to job folder {folder}: {error.strerror}") from error
    output.publish()
    path = str(folder / "template.json")
    command = ["openjd", "run", f"./{path}" if path.startswith("-") else path, *(["-p", f"OutputDir={results}"] if results else [])]
    quoted = subprocess.list2cmdline(command) if os.name == "nt" else shlex.join(command)
    terminal.say(f"Wrote the job to {folder}. To run it here: {quoted}")


def _write(path: Path, document: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def _copy_code(folder: Path) -> str:
    """Copy the code that tasks run into `folder`, and return its digest."""
    digest = hashlib.sha256()
    for name in CODE:
        place = ROOT / name
        for path in sorted(place.rglob("*")) if place.is_dir() else (place,):
            if path.suffix in SUFFIXES:
                digest.update(path.relative_to(ROOT).as_posix().encode() + path.read_bytes())
                target = folder / path.relative_to(ROOT)
                target.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(path, target)
    return digest.hexdigest()


def _step(step: Step) -> dict[str, Any]:
    space: dict[str, Any] = {"taskParameterDefinitions": step.parameters}
    if step.combination:
        space["combination"] = step.combination
    given = [word for one in step.parameters for word in (f"--{one['name'].lower()}", f"{{{{Task.Param.{one['name']}}}}}")]
    return {
        "name": step.name,
        "description": step.description,
        **({"dependencies": [{"dependsOn": name} for name in step.after]} if step.after else {}),
        **({"parameterSpace": space} if step.parameters else {}),
        "script": {"actions": {"onRun": _action(step.command, "--out", "{{Param.OutputDir}}", *step.fixed, *given)}},
    }


def _path(name: str, flow: str, default: str, description: str) -> Parameter:
    kind = {"type": "PATH", "objectType": "DIRECTORY", "dataFlow": flow}
    return {"name": name, **kind, "default": default, "description": description}


def _text(name: str, default: str, description: str) -> Parameter:
    return {"name": name, "type": "STRING", "default": default, "description": description}


def _action(command: str, *arguments: str) -> dict[str, Any]:
    script, job = "{{Param.JobDir}}/true_diffuse/scripts/task.py", "{{Param.JobDir}}"
    session = ["--session", "{{Session.WorkingDirectory}}", "--path-mapping", "{{Session.PathMappingRulesFile}}"]
    return {
        "command": "{{Param.Python}}",
        "args": [script, command, job, *session, "--blender", "{{Param.Blender}}", *arguments],
    }
