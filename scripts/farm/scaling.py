# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures what a job costs beside its renders: one session, two side by side, one of two killed; and what that makes of a farm.

uv run scripts/farm/scaling.py --out scaling.json
"""

import json
import math
import os
import shutil
import signal
import statistics
import subprocess
import sys
import tempfile
import time
from argparse import Namespace
from collections.abc import Callable, Sequence
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import run_script

SCRIPTS = Path(__file__).resolve().parents[1]
ENGINES = ("eevee", "cycles")
ORDER = ("--engine", ",".join(ENGINES), "--resolution", "320x120", "--samples", "8")  # of the human
LOOKS = ("picture", "specular", "lambert", "oren_nayar_0", "oren_nayar_0.2", "oren_nayar_0.33")
TASKS = [{"Character": "0", "Engine": engine, "Look": look} for engine in ENGINES for look in LOOKS]
# every other task, so that each share has both engines and one of the pictures, which take longest
SHARES = [[task for k, task in enumerate(TASKS) if (k + k // len(LOOKS)) % 2 == share] for share in (0, 1)]
FARM_TASKS, FARM_MACHINES = 10_000, (1, 10, 100, 1000)
AGAIN = 5  # how often what is short is timed

type Task = dict[str, str]


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="scaling.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("scaling.json"), metavar="FILE", help="default: scaling.json")
    options = parser.parse_args(script_arguments())
    return run_script(parser.prog, options.out.parent, partial(scaling, options), name=options.out.name)


def scaling(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Measure, write what was found, and show it."""
    if find_spec("openjd") is None:
        raise BadInput("sessions need the package openjd-cli")
    seconds, records = {}, {}
    with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder, terminal.progress(4.0) as progress:
        job = Path(folder) / "job"
        script("compare.py", "--job", job, *ORDER)
        for name, run in (
            ("one session", lambda: finish(session(job, TASKS))),
            ("two sessions", lambda: finish(*(session(job, share) for share in SHARES))),
            ("two sessions, one killed and run again", lambda: finish(*killed(job, 0.5 * seconds["two sessions"]))),
        ):
            with progress.step(name, 1.0):
                seconds[name] = timed(run)
                records[name] = collected(job)
        with progress.step("what the time is spent on", 1.0):
            parts = costs(job)
    found = {
        "cores": os.cpu_count(),
        "tasks": len(TASKS),
        "seconds": seconds,
        "same_records": all(each == records["one session"] for each in records.values()),
        "costs": parts,
        "farm": [farm(parts, machines) for machines in FARM_MACHINES],
    }
    output.write_json(options.out.name, found)
    output.publish()
    for name, value in (seconds | parts).items():
        terminal.say(f"{name}: {value:.3g}")
    terminal.say(f"Merged records: {'the same' if found['same_records'] else 'DIFFERENT'}, times aside")
    rows = [[f"{value:.3g}" for value in one.values()] for one in found["farm"]]
    terminal.table(f"{FARM_TASKS} tasks, on paper", tuple(found["farm"][0]), rows)
    terminal.say(f"Wrote {options.out}")


def timed(do: Callable[[], object]) -> float:
    """Return how long something takes [s]."""
    start = time.perf_counter()
    do()
    return time.perf_counter() - start


def script(name: str, *arguments: str | Path) -> None:
    """Run one of the scripts; raises BadInput with its last words where it fails."""
    result = subprocess.run([sys.executable, SCRIPTS / name, *arguments], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise BadInput(f"{name}: {' '.join((result.stderr or result.stdout).split())[-300:]}")


def do(job: Path, task: Task, at: Sequence[str | Path]) -> None:
    """Do a task in a session begun by hand."""
    script("task.py", "render", job, *at, *(word for name, value in task.items() for word in (f"--{name.lower()}", value)))


def session(job: Path, tasks: Sequence[Task]) -> "subprocess.Popen[bytes]":
    """Start a session of Open Job Description that does `tasks`."""
    command = [sys.executable, "-m", "openjd", "run", job / "template.json", "--step", "render", "--tasks", json.dumps(tasks)]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True)


def killed(job: Path, after: float) -> list["subprocess.Popen[bytes]"]:
    """Start two sessions, kill the first `after` so many seconds, and start it again."""
    first, second = (session(job, share) for share in SHARES)
    time.sleep(after)
    first.send_signal(signal.SIGKILL)
    first.wait()
    return [session(job, SHARES[0]), second]


def finish(*sessions: "subprocess.Popen[bytes]") -> None:
    """Wait for sessions."""
    statuses = [each.wait() for each in sessions]
    if any(statuses):
        raise BadInput("a session failed: run the job by openjd to see why")


def collected(job: Path) -> list[dict[str, Any]]:
    """Draw the error maps, return the records, times left out, and remove the results."""
    script("task.py", "render", job)
    script("task.py", "collect", job)
    found = json.loads((job / "output" / "compare.json").read_text())["records"]
    shutil.rmtree(job / "output")
    return [{key: value for key, value in record.items() if key != "render_seconds"} for record in found]


def costs(job: Path) -> dict[str, float]:
    """Return what the time of a session is made of [s] and what it moves [bytes], each by itself."""
    folder = job / "session"
    folder.mkdir()
    at = ("--session", folder)
    start = timed(lambda: script("task.py", "begin", job, *at))
    cold = timed(lambda: do(job, TASKS[0], at))
    shutil.rmtree(job / "output")
    spent = [timed(partial(do, job, task, at)) for task in TASKS]
    nothing = min(timed(lambda: do(job, TASKS[0], at)) for _ in range(AGAIN))
    drawn = [timed(partial(do, job, {"Engine": engine, "Look": "error_map"}, at)) for engine in ENGINES]
    collect = min(timed(lambda: script("task.py", "collect", job, *at)) for _ in range(AGAIN))
    script("task.py", "end", job, *at)
    return {
        "start_seconds": start,
        "scene_seconds": max(0.0, cold - spent[0]),
        "task_seconds": statistics.fmean(spent),
        "nothing_seconds": nothing,
        "map_seconds": statistics.fmean(drawn),
        "collect_seconds_per_task": max(0.0, collect - nothing) / len(TASKS),  # beyond what any task takes
        "result_bytes_per_task": size(job / "output" / "items") / len(TASKS),
        "bundle_bytes": size(job / "true_diffuse"),
    }


def size(folder: Path) -> float:
    """Return the bytes of all files in a folder."""
    return float(sum(path.stat().st_size for path in folder.rglob("*") if path.is_file()))


def farm(costs: dict[str, float], machines: int) -> dict[str, float]:
    """Return what FARM_TASKS take on so many machines, on paper: seconds [s], fractions of 1, and bytes moved.

    A machine does its share one after the other, each scene's tasks together; collect waits for all. `start_share` is what starting
    Blender and building scenes takes of a machine's time, `start_share_alone` were both done for every task.
    """
    work = costs["task_seconds"] + costs["map_seconds"] / len(LOOKS)
    share = FARM_TASKS / machines
    start = costs["start_seconds"] + math.ceil(share / len(TASKS)) * costs["scene_seconds"]
    each = costs["start_seconds"] + costs["scene_seconds"]
    collect = costs["start_seconds"] + FARM_TASKS * costs["collect_seconds_per_task"]
    seconds = start + share * work + collect
    return {
        "machines": machines,
        "seconds": seconds,
        "start_share": start / (start + share * work),
        "start_share_alone": each / (each + work),
        "collect_share": collect / seconds,
        "efficiency": FARM_TASKS * work / (machines * seconds),
        "bytes": machines * costs["bundle_bytes"] + FARM_TASKS * costs["result_bytes_per_task"],
    }


if __name__ == "__main__":
    end(main())
