# SPDX-License-Identifier: GPL-3.0-or-later
"""A job bundle of Open Job Description, in the layout that AWS Deadline Cloud reads, as JSON. No bpy.

https://github.com/OpenJobDescription/openjd-specifications (2023-09). The bundle carries the code that its tasks run, so that it
needs nothing of the checkout and gives the same figures while that goes on. A session's environment keeps one Blender alive.
"""

import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
CODE = ("__init__.py", "blender_manifest.toml", "addon", "scenes", "scripts", "shaders")
SUFFIXES = (".py", ".toml", ".json", ".glsl", ".osl", ".blend")
JOB = "job.json"  # the study and its JobSpec
SESSION = ["--session", "{{Session.WorkingDirectory}}"]
PATHS = ["--path-mapping", "{{Session.PathMappingRulesFile}}"]
BEGIN_SECONDS, END_SECONDS = 600, 60


@dataclass(frozen=True)
class Step:
    """A step of a job: a task for each combination of its `parameters`, as `combination` says or all with all.

    It is what scripts/task.py does by `command` with the arguments `fixed`, once the steps `after` are done.
    """

    name: str
    command: str
    description: str
    parameters: Sequence[Mapping[str, Any]] = ()
    combination: str = ""
    fixed: Sequence[str] = ()
    after: Sequence[str] = ()


@dataclass(frozen=True)
class Job:
    """What a bundle is written of. `python` runs the tasks; `blender` is a Blender to render with, "" for Python's module bpy."""

    name: str
    description: str
    document: Mapping[str, Any]
    steps: Sequence[Step]
    inputs: Sequence[str]
    python: str
    blender: str


def write(job: Job, folder: Path, output: Path | None) -> None:
    """Write the bundle into `folder`, which is there. Results go to `output`, or where None is given to the bundle's own folder.

    Raises OSError.
    """
    values = [{"name": "OutputDir", "value": str(output)}] if output else []
    inputs, outputs = {"filenames": list(job.inputs), "directories": []}, {"directories": [str(output)] if output else []}
    _write(folder / "template.json", template(job))
    _write(folder / "parameter_values.json", {"parameterValues": values})
    assets = {"inputs": inputs, "outputs": outputs, "referencedPaths": []}
    _write(folder / "asset_references.json", {"assetReferences": assets})
    code = hashlib.sha256()
    for path in _code():
        place = path.relative_to(ROOT)
        code.update(place.as_posix().encode() + path.read_bytes())
        target = folder / "true_diffuse" / place
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, target)
    # results of another version of the code are those of another job
    _write(folder / JOB, {**job.document, "code": code.hexdigest()})


def _write(path: Path, document: Mapping[str, Any]) -> None:
    path.write_text(json.dumps(document, indent=2) + "\n", encoding="utf-8")


def _code() -> Iterator[Path]:
    """Yield the files of the code that tasks run."""
    for name in CODE:
        place = ROOT / name
        for path in sorted(place.rglob("*")) if place.is_dir() else (place,):
            if path.suffix in SUFFIXES:
                yield path


def template(job: Job) -> dict[str, Any]:
    """Return the job's template."""
    chunked = any(one["type"] == "CHUNK[INT]" for step in job.steps for one in step.parameters)
    keep = {
        "name": "Blender",
        "description": "One Blender for all tasks of a session: started once, a scene built once for all its tasks",
        "script": {
            "actions": {
                "onEnter": _action("begin", [*SESSION, *PATHS, *BLENDER], BEGIN_SECONDS),
                "onExit": _action("end", SESSION, END_SECONDS),
            }
        },
    }
    return {
        "specificationVersion": "jobtemplate-2023-09",
        **({"extensions": ["TASK_CHUNKING"]} if chunked else {}),
        "name": job.name,
        "description": job.description,
        "parameterDefinitions": [
            _path("JobDir", "IN", ".", "This bundle"),
            _path("OutputDir", "OUT", "output", "Where results go"),
            {"name": "Python", "type": "STRING", "default": job.python, "description": "Python 3.13 that runs the tasks"},
            {
                "name": "Blender",
                "type": "STRING",
                "default": job.blender,
                "description": "Blender to render with; nothing for the module bpy of Python",
            },
        ],
        "jobEnvironments": [keep],
        "steps": [_step(step) for step in job.steps],
    }


def _step(step: Step) -> dict[str, Any]:
    space: dict[str, Any] = {"taskParameterDefinitions": list(step.parameters)}
    if step.combination:
        space["combination"] = step.combination
    given = [word for one in step.parameters for word in (f"--{one['name'].lower()}", f"{{{{Task.Param.{one['name']}}}}}")]
    return {
        "name": step.name,
        "description": step.description,
        **({"dependencies": [{"dependsOn": name} for name in step.after]} if step.after else {}),
        **({"parameterSpace": space} if step.parameters else {}),
        "script": {"actions": {"onRun": _action(step.command, [*OUTPUT, *SESSION, *PATHS, *BLENDER, *step.fixed, *given])}},
    }


OUTPUT = ["--out", "{{Param.OutputDir}}"]
BLENDER = ["--blender", "{{Param.Blender}}"]


def _path(name: str, flow: str, default: str, description: str) -> dict[str, str]:
    return {
        "name": name,
        "type": "PATH",
        "objectType": "DIRECTORY",
        "dataFlow": flow,
        "default": default,
        "description": description,
    }


def _action(command: str, arguments: Sequence[str], timeout: int | None = None) -> dict[str, Any]:
    script = "{{Param.JobDir}}/true_diffuse/scripts/task.py"
    action = {"command": "{{Param.Python}}", "args": [script, command, "{{Param.JobDir}}", *arguments]}
    return action if timeout is None else {**action, "timeout": timeout}
