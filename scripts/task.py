# SPDX-License-Identifier: GPL-3.0-or-later
"""Does tasks of a job that compare.py or report.py wrote with --job: as Open Job Description starts them, or by hand.

uv run scripts/task.py render JOB                  does all that is not done yet, in one Blender
uv run scripts/task.py collect JOB                 merges what is done
blender -b --python scripts/task.py -- render JOB
"""

import hashlib
import json
import os
import signal
import sys
from argparse import Namespace
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.characters import reading
from true_diffuse.scripts.cli import process
from true_diffuse.scripts.cli.console import (
    CLOSED_PIPE,
    BadInput,
    Parser,
    Show,
    Terminal,
    end,
    one_line,
    say_error,
    script_arguments,
)
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import NO_SHADER_CACHE, start_blender
from true_diffuse.scripts.farm import worker
from true_diffuse.scripts.farm.bundle import JOB
from true_diffuse.scripts.farm.results import Results
from true_diffuse.scripts.studies.comparison.outcomes import WorkError

if TYPE_CHECKING:
    from true_diffuse.scripts.farm.worker import Request

KEEPER = os.getppid()  # before anything takes long: where it dies meanwhile, there would be another
ITEMS = "items"  # the folder of the output that tasks write to
PARAMETERS = ("character", "frame", "engine", "look", "scene", "seed", "variant")


def main() -> int:
    """Run the script; returns the exit status: 1 where a task failed, 2 for what the user can fix."""
    options = parse(script_arguments())
    if options.session:  # whose own Blender reads the files
        return run(options)
    return process.alone("task.py", partial(run, options), "run it again to go on from here")


def run(options: Namespace) -> int:
    """Do what the options ask for; returns the exit status as `main` does."""
    try:
        try:
            COMMANDS[options.command](options)
        except WorkError as error:
            print(*error.details, f"openjd_fail: {one_line(str(error))}", sep="\n", flush=True)
            return 1
        except BadInput as error:
            print(f"openjd_fail: {one_line(str(error))}", flush=True)
            return say_error("task.py", str(error))
    except BrokenPipeError:
        return CLOSED_PIPE
    return 0


def parse(arguments: list[str]) -> Namespace:
    """Return the options; ends the process with one line and status 2 where they make no sense."""
    parser = Parser(prog="task.py", description=(__doc__ or "").splitlines()[0])
    add = parser.add_argument
    text = "begin, end: start or end the Blender of a session; serve: run as it; reference: render what others are held against; "
    text += "render: render work items, without a choice all that are not done yet; collect: merge what the work items came to"
    add("command", choices=COMMANDS, metavar="COMMAND", help=text)
    add("job", type=Path, help="folder of the job's bundle")
    add("--session", type=Path, metavar="DIR", help="folder of the session; without it, no Blender is kept")
    add("--path-mapping", type=Path, metavar="FILE", help="where this machine has the paths of the job's files")
    add("--blender", default="", metavar="PATH", help="Blender to start in place of the module bpy")
    add("--out", type=Path, metavar="DIR", help="folder of the results (default: output, in the bundle)")
    for parameter in PARAMETERS:
        add(f"--{parameter}", help="reference, render: as the job's template has it")
    add("--keeper", type=int, help="serve: process that the session ends with")
    options = parser.parse_args(arguments)
    if options.command in ("begin", "end", "serve") and options.session is None:
        parser.error(f"{options.command} needs --session")
    return options


def begin(options: Namespace) -> None:
    """Start the Blender of a session: a worker that ends with the process that runs the session."""
    print("openjd_status: Starting Blender", flush=True)
    read_job(options)
    here = str(Path(__file__).resolve())
    command = [options.blender, "--background", "--python", here, "--"] if options.blender else [sys.executable, here]
    mapping = ["--path-mapping", options.path_mapping] if options.path_mapping else []
    serving = ["serve", options.job, "--session", options.session, "--keeper", str(KEEPER), *mapping]
    worker.begin(options.session, [*command, *serving])


def do(options: Namespace) -> None:
    """Do a task in the session's Blender or, without a session, in this process; print its progress."""
    out = (options.out or options.job / "output").absolute()
    given = {name: getattr(options, name) for name in PARAMETERS if getattr(options, name) is not None}
    request = {"step": options.command, "out": str(out), "parameters": given}
    with Terminal() as terminal:
        last = ""

        def show(percent: float, text: str) -> None:
            nonlocal last
            if text != last:
                terminal.say(f"openjd_status: {text}")
                last = text
            terminal.say(f"openjd_progress: {percent:.1f}")

        said = in_session(options, request, show) if options.session else request_handler(options, terminal)(request, show)
        for line in said:
            terminal.say(line)
        terminal.say("openjd_progress: 100.0")


def in_session(options: Namespace, request: "Request", show: Show) -> list[str]:
    """Have the session's Blender do a request; returns lines to print. Raises WorkError."""
    try:
        return worker.ask(options.session, request, show)
    except ConnectionResetError as error:
        raise WorkError(str(error)) from error
    except ConnectionError:  # it has died before
        begin(options)
        return worker.ask(options.session, request, show)


def end_session(options: Namespace) -> None:
    """End the Blender of a session."""
    worker.end(options.session)


def serve(options: Namespace) -> None:
    """Run as the Blender of a session until that ends."""
    if hasattr(signal, "pthread_sigmask"):  # whoever started the session may have blocked it
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGTERM})
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    reading.supervised(options.session / worker.NOTE)
    # a terminal that is not entered, as the output of this process is a log already
    worker.serve(options.session, options.keeper, request_handler(options, Terminal()))


def request_handler(options: Namespace, terminal: Terminal) -> "Callable[[Request, Show], list[str]]":
    """Start Blender and return the function that does a request; it returns lines to print. Raises BadInput."""
    document, job = read_job(options)
    try:
        if document["study"] == "report":
            os.environ.update(NO_SHADER_CACHE)
        usable = start_blender(document["spec"]["engines"], terminal)
        from true_diffuse.scripts.farm.comparison import CompareJob
        from true_diffuse.scripts.farm.report import ReportJob

        study: CompareJob | ReportJob = (ReportJob if document["study"] == "report" else CompareJob)(document, usable)
    except (KeyError, TypeError) as error:
        raise BadInput(f"{options.job / JOB} is no job: {error}") from error

    def answer(request: "Request", show: Show) -> list[str]:
        out = Path(request["out"])
        results = Results(out / ITEMS, job)
        if request["step"] != "collect":
            study.do(request["step"], request["parameters"], results, show)
            return []
        try:
            with OutputFolder(out) as output:
                show(0.0, "Collecting")
                return study.collect(results, output)
        except BadInput as error:
            raise WorkError(str(error)) from error

    return answer


def read_job(options: Namespace) -> tuple[dict[str, Any], str]:
    """Return the job's document, with paths of this machine, and the digest that names it in results. Raises BadInput."""
    path = options.job / JOB
    try:
        content = path.read_bytes()
        document = json.loads(content)
        rules = json.loads(options.path_mapping.read_bytes() or b"{}") if options.path_mapping else {}
        given, spec = rules.get("path_mapping_rules", ()), document["spec"]
        spec["characters"] = {name: mapped(who, given) for name, who in spec["characters"].items()}
    except OSError as error:
        raise BadInput(f"cannot read {error.filename}: {error.strerror}") from error
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise BadInput(f"{path} is no job: {error}") from error
    return document, hashlib.sha256(content).hexdigest()


def mapped(path: str, rules: list[dict[str, str]]) -> str:
    """Return where this machine has a file, by the rules of the schema pathmapping-1.0."""
    for rule in sorted(rules, key=lambda rule: -len(rule["source_path"])):
        source = rule["source_path"].rstrip("/\\")
        if path == source or path.startswith((f"{source}/", f"{source}\\")):
            rest = path[len(source) :].replace("\\", "/").lstrip("/")
            return str(Path(rule["destination_path"], rest))
    return path


COMMANDS: dict[str, Callable[[Namespace], None]] = {
    "begin": begin,
    "reference": do,
    "render": do,
    "collect": do,
    "end": end_session,
    "serve": serve,
}

if __name__ == "__main__":
    end(main())
