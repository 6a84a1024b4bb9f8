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
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import NODE_ENGINES, engine_list, run_script, sample_count

SCRIPTS = Path(__file__).resolve().parents[1]
LOOKS = ("picture", "specular", "lambert", "oren_nayar_0", "oren_nayar_0.2", "oren_nayar_0.33")
ERROR_MAP = "error_map"
FARM_TASKS, FARM_MACHINES = 10_000, (1, 10, 100, 1000)
AGAIN = 5  # how often what is short is timed
WORK = {"one": 5.0, "two": 4.0, "killed": 6.0, "costs": 6.0}

type Task = dict[str, str | int]


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="scaling.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--engine", type=engine_list, default=NODE_ENGINES, metavar="LIST", help="default: eevee,cycles")
    parser.add_argument("--character", default="human", metavar="WHO", help="default: human")
    parser.add_argument("--resolution", default="320x120", metavar="WxH", help="pixels (default: 320x120)")
    parser.add_argument("--samples", type=sample_count, default=8, metavar="N", help="per pixel (default: 8)")
    parser.add_argument("--out", type=Path, default=Path("scaling.json"), metavar="FILE", help="default: scaling.json")
    options = parser.parse_args(script_arguments())
    return run_script(parser.prog, options.out.parent, partial(scaling, options))


def scaling(options: Namespace, output: OutputFolder, terminal: Terminal) -> None:
    """Measure, write what was found, and show it."""
    if find_spec("openjd") is None:
        raise BadInput("sessions need the package openjd-cli")
    with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder, terminal.progress(sum(WORK.values())) as progress:
        job, wait = Job(Path(folder), options), {}
        with progress.step("One session", WORK["one"]):
            wait["one"] = timed(lambda: job.run(job.tasks))
        alone = job.collected("one")
        with progress.step("Two sessions", WORK["two"]):
            wait["two"] = timed(lambda: job.side_by_side(None))
        pair = job.collected("two")
        with progress.step("Two sessions, one killed", WORK["killed"]):
            wait["killed"] = timed(lambda: job.side_by_side(0.5 * wait["two"]))
        killed = job.collected("killed")
        with progress.step("What the time is spent on", WORK["costs"]):
            costs = job.costs()
    found = {
        "cores": os.cpu_count(),
        "load": os.getloadavg() if hasattr(os, "getloadavg") else None,
        "options": {**vars(options), "out": str(options.out)},
        "tasks": len(job.tasks),
        "seconds": wait,
        "same_records": {"two": pair == alone, "killed": killed == alone},
        "costs": costs,
        "farm": farm(costs, len(job.tasks)),
    }
    output.write_json(options.out.name, found)
    output.publish()
    show(found, terminal)
    terminal.say(f"Wrote {options.out}")


def timed(do: Callable[[], None]) -> float:
    """Return how long something takes [s]."""
    start = time.perf_counter()
    do()
    return time.perf_counter() - start


def least(do: Callable[[], None]) -> float:
    """Return the least time that something short takes, of AGAIN times [s]."""
    return min(timed(do) for _ in range(AGAIN))


class Job:
    """A job of five characters in `folder`, and sessions that run it."""

    def __init__(self, folder: Path, options: Namespace) -> None:
        self.folder = folder / "job"
        arguments = ["--character", options.character, "--resolution", options.resolution, "--samples", str(options.samples)]
        script("compare.py", "--job", self.folder, "--engine", ",".join(options.engine), *arguments)
        self.tasks: list[Task] = [{"Character": 0, "Engine": engine, "Look": look} for engine in options.engine for look in LOOKS]

    def session(self, tasks: Sequence[Task]) -> "subprocess.Popen[bytes]":
        """Start a session that does `tasks`."""
        command = [sys.executable, "-m", "openjd", "run", self.folder / "template.json", "--step", "render"]
        return subprocess.Popen(
            [*command, "--tasks", json.dumps(tasks)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, start_new_session=True
        )

    def run(self, tasks: Sequence[Task]) -> None:
        """Do `tasks` in a session."""
        if self.session(tasks).wait() != 0:
            raise BadInput("a session failed: run the job by openjd to see why")

    def side_by_side(self, kill_after: float | None) -> None:
        """Do all tasks in two sessions; the first is killed after so many seconds [s], and what it had is run again."""
        # every other task, so that each has both engines and one of the pictures, which take longest
        shares = [[task for k, task in enumerate(self.tasks) if (k + k // len(LOOKS)) % 2 == share] for share in (0, 1)]
        first, second = (self.session(share) for share in shares)
        if kill_after is not None:
            time.sleep(kill_after)
            first.send_signal(signal.SIGKILL)
            first.wait()
            first = self.session(shares[0])
        if first.wait() != 0 or second.wait() != 0:
            raise BadInput("a session failed: run the job by openjd to see why")

    def collected(self, name: str) -> list[dict[str, Any]]:
        """Draw the error maps, return the records, times left out, and put the results aside."""
        script("task.py", "render", self.folder)
        script("task.py", "collect", self.folder)
        found = json.loads((self.folder / "output" / "compare.json").read_text())["records"]
        (self.folder / "output").rename(self.folder / name)
        return [{key: value for key, value in record.items() if key != "render_seconds"} for record in found]

    def costs(self) -> dict[str, float]:
        """Return what the time of a session is made of [s] and what it moves [bytes], each by itself."""
        session = self.folder / "session"
        session.mkdir()
        at = ("--session", session)
        start = timed(lambda: script("task.py", "begin", self.folder, *at))
        cold = timed(lambda: self.do(self.tasks[0], at))
        for path in (self.folder / "output").rglob(f"*_{self.tasks[0]['Look']}.json"):
            path.unlink()
        spent = [timed(lambda task=task: self.do(task, at)) for task in self.tasks]
        nothing = least(lambda: self.do(self.tasks[0], at))
        maps = [{**task, "Look": ERROR_MAP} for task in self.tasks if task["Look"] == LOOKS[0]]
        drawn = [timed(lambda task=task: self.do(task, at)) for task in maps]
        collect = least(lambda: script("task.py", "collect", self.folder, *at))
        script("task.py", "end", self.folder, *at)
        shutil.rmtree(session)
        kept = [path for path in (self.folder / "output" / "items").rglob("*") if path.is_file()]
        code = [path for path in (self.folder / "true_diffuse").rglob("*") if path.is_file()]
        return {
            "start_seconds": start,
            "scene_seconds": max(0.0, cold - spent[0]),
            "task_seconds": statistics.fmean(spent),
            "nothing_seconds": nothing,
            "map_seconds": statistics.fmean(drawn),
            "collect_seconds_per_task": max(0.0, collect - nothing) / len(self.tasks),  # beyond what any task takes
            "result_bytes_per_task": sum(path.stat().st_size for path in kept) / len(self.tasks),
            "bundle_bytes": float(sum(path.stat().st_size for path in code)),
        }

    def do(self, task: Task, at: Sequence[str | Path]) -> None:
        """Do a task in a session begun by hand."""
        given = [str(word) for name, value in task.items() for word in (f"--{name.lower()}", value)]
        script("task.py", "render", self.folder, *at, *given)


def script(name: str, *arguments: str | Path) -> None:
    """Run one of the scripts; raises BadInput with its last words where it fails."""
    result = subprocess.run([sys.executable, SCRIPTS / name, *arguments], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise BadInput(f"{name}: {' '.join((result.stderr or result.stdout).split())[-300:]}")


def farm(costs: dict[str, float], tasks_per_scene: int) -> list[dict[str, float]]:
    """Return what FARM_TASKS take on so many machines, on paper: seconds [s], and shares of 1.

    A machine does its share one after the other, each scene's tasks together; collect waits for all. `start_share` is what starting
    Blender and building scenes takes of a machine's time, `start_share_alone` were both done for every task.
    """
    found = []
    work = costs["task_seconds"] + costs["map_seconds"] / len(LOOKS)
    collect = costs["start_seconds"] + FARM_TASKS * costs["collect_seconds_per_task"]
    for machines in FARM_MACHINES:
        share = FARM_TASKS / machines
        start = costs["start_seconds"] + math.ceil(share / tasks_per_scene) * costs["scene_seconds"]
        each = costs["start_seconds"] + costs["scene_seconds"]
        seconds = start + share * work + collect
        found.append(
            {
                "machines": machines,
                "seconds": seconds,
                "start_share": start / (start + share * work),
                "start_share_alone": each / (each + work),
                "collect_share": collect / seconds,
                "efficiency": FARM_TASKS * work / (machines * seconds),
                "bytes": machines * costs["bundle_bytes"] + FARM_TASKS * costs["result_bytes_per_task"],
            }
        )
    return found


def show(found: dict[str, Any], terminal: Terminal) -> None:
    """Show what was found."""
    for name, text in (
        ("one", "One session"),
        ("two", "Two sessions"),
        ("killed", "Two sessions, one killed and run again"),
    ):
        terminal.say(f"{text}: {found['seconds'][name]:.1f} s for {found['tasks']} tasks on {found['cores']} cores")
    same = all(found["same_records"].values())
    terminal.say(f"Merged records: {'the same, one by one' if same else 'DIFFERENT'}, times aside")
    for name, value in found["costs"].items():
        terminal.say(f"{name}: {value:.3g}")
    columns = ("Machines", "", "Hours", "Starting", "were it for every task", "Collect", "Efficiency", "GB moved")
    rows = [
        (
            str(one["machines"]),
            "",
            f"{one['seconds'] / 3600.0:.2f}",
            *(f"{100.0 * one[name]:.1f} %" for name in ("start_share", "start_share_alone", "collect_share", "efficiency")),
            f"{one['bytes'] / 1e9:.1f}",
        )
        for one in found["farm"]
    ]
    terminal.table(f"{FARM_TASKS} tasks, on paper", columns, rows)


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
