# SPDX-License-Identifier: GPL-3.0-or-later
"""Whatever ends a script or is in its way: one line, no half-written file, and the next run gives what it would have given."""

import json
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from support import SCRIPTS, assert_bad_input, run_script, wait_for

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows has no such signals and files")

SMALL = ("--character", "monkey", "--engine", "cycles", "--resolution", "96x36", "--samples", "2")
ENDLESS = ("--character", "monkey", "--engine", "cycles", "--resolution", "640x240", "--samples", "65536")
PICTURES = ["compare.json", "error_cycles.png", "five_cycles.exr", "five_cycles.png"]
KILLS = 20


def start(name: str, *arguments: str | Path, cwd: Path, **options: Any) -> subprocess.Popen[str]:
    """Start a script in a group of its own."""
    command = [sys.executable, SCRIPTS / name, *arguments]
    return subprocess.Popen(command, cwd=cwd, text=True, start_new_session=True, **options)


@pytest.fixture
def endless(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """A comparison that renders for hours into the folder out."""
    quiet = subprocess.DEVNULL
    process = start("compare.py", *ENDLESS, "--out", "out", cwd=tmp_path, stdout=quiet, stderr=subprocess.PIPE)
    wait_for(lambda: list(tmp_path.glob("out/.true_diffuse_.*/files")))
    yield process
    process.kill()
    process.wait()


def children(process: int) -> list[int]:
    """The processes that another has started."""
    return [int(word) for word in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


def lives(process: int) -> bool:
    """Whether a process runs; one that ended and that nobody waited for does not."""
    status = Path(f"/proc/{process}/stat")
    return status.exists() and status.read_text().rpartition(")")[2].split()[0] not in "ZX"


def test_second_run_into_a_folder_is_refused_until_the_first_ends(endless: subprocess.Popen[str], tmp_path: Path) -> None:
    before = sorted((tmp_path / "out").iterdir())
    result = run_script("compare.py", *SMALL, "--out", "out", cwd=tmp_path)
    assert_bad_input(result, "compare.py: error: ")
    assert "another run" in result.stderr and sorted((tmp_path / "out").iterdir()) == before
    other = run_script("export_usd.py", "--character", "monkey", "--out", "out/scene.usda", cwd=tmp_path)
    assert other.returncode == 0, other.stderr  # writes another file there
    endless.send_signal(signal.SIGKILL)
    endless.wait()
    assert len(list((tmp_path / "out").glob(".true_diffuse_.*"))) == 2  # nobody could remove the lock and the hidden folder
    result = run_script("compare.py", *SMALL, "--out", "out", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [*PICTURES, "scene.usda", "textures"]


@pytest.mark.skipif(sys.platform != "linux", reason="the children of a process are seen in /proc")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP", "SIGKILL"])
def test_process_that_works_ends_with_the_first(name: str, endless: subprocess.Popen[str], tmp_path: Path) -> None:
    (second,) = wait_for(lambda: children(endless.pid))
    time.sleep(random.Random(name).uniform(0.0, 4.0))
    if name == "SIGINT":
        os.killpg(endless.pid, signal.SIGINT)  # as the terminal does
    else:
        endless.send_signal(getattr(signal, name))
    _, said = endless.communicate(timeout=5)
    wait_for(lambda: not lives(second), seconds=5.0)
    if name == "SIGKILL":
        assert not [path for path in (tmp_path / "out").iterdir() if not path.name.startswith(".true_diffuse_.")]
    else:
        assert endless.returncode == 128 + getattr(signal, name)
        assert said.strip() == "compare.py: stopped, nothing written" and not (tmp_path / "out").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="the children of a process are seen in /proc")
def test_crash_is_one_line(endless: subprocess.Popen[str], tmp_path: Path) -> None:
    (second,) = wait_for(lambda: children(endless.pid))
    os.kill(second, signal.SIGSEGV)
    _, said = endless.communicate(timeout=5)
    assert endless.returncode == 2 and said == "compare.py: error: crashed (SIGSEGV)\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "command",
    [
        "compare.py --help | head -n 1",
        f"compare.py {' '.join(SMALL)} --out out | head -n 1",
        "compare.py --character monkey --job j | true",
        "task.py render . | true",
    ],
)
def test_output_that_nobody_reads_on_ends_as_usual(command: str, tmp_path: Path) -> None:
    line = f"set -o pipefail; '{sys.executable}' '{SCRIPTS}/'{command}"
    result = subprocess.run(["bash", "-c", line], cwd=tmp_path, capture_output=True, text=True, check=False)
    # as of any program that writes on: 128 + SIGPIPE; of help, head may have read all
    assert result.returncode in ((0, 141) if "--help" in command else (141,)), result.stderr
    assert result.stderr == "" and len(result.stdout.splitlines()) <= 1 and not (tmp_path / "out").exists()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="this system has no /dev/full")
def test_output_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    for arguments in ((*SMALL, "--out", "out"), ("--help",)):
        with Path("/dev/full").open("w") as full:
            process = start("compare.py", *arguments, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE)
            _, said = process.communicate()
        assert process.returncode == 2 and said == "compare.py: error: cannot write to standard output: No space left on device\n"
    assert not (tmp_path / "out").exists()


@pytest.mark.render
def test_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=48k", "none", disk], capture_output=True, check=False).returncode != 0:
        pytest.skip("nobody but root can make a small disk")
    try:
        result = run_script("compare.py", *SMALL, "--resolution", "640x240", "--out", disk / "out", cwd=tmp_path)
        assert_bad_input(result, "compare.py: error: No space left on device")
        result = run_script("compare.py", "--character", "monkey", "--job", disk / "job", cwd=tmp_path)
        assert_bad_input(result, f"compare.py: error: cannot write to job folder {disk / 'job'}: No space left on device")
        assert not list(disk.iterdir())
    finally:
        subprocess.run(["umount", disk], check=True)


def test_folder_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    assert_bad_input(
        run_script("compare.py", *SMALL, "--out", "/proc/out", cwd=tmp_path), "compare.py: error: cannot write to output"
    )
    assert_bad_input(
        run_script("compare.py", *SMALL, "--job", "x" * 300, cwd=tmp_path), "compare.py: error: cannot write to output"
    )
    assert_bad_input(run_script("compare.py", "--character", f"{'x' * 5000}.glb", cwd=tmp_path), "compare.py: error: ")
    (tmp_path / "file").touch()
    assert_bad_input(run_script("report.py", "--out", "file", cwd=tmp_path), "report.py: error: cannot write to output folder file")


@pytest.mark.slow
def test_characters_may_have_any_name(tmp_path: Path) -> None:
    stems = [
        "a b  c",
        'it\'s "q"',
        "two\nlines",
        "-dash",
        "...",
        "ärger 你好",
        "x" * 240,
        "[1]*?",
        "$HOME;`id`",
        "\udcff",
        "\x1b[31m",
    ]
    files = [tmp_path / f"{stem}.obj" for stem in stems]
    for file in files:
        file.write_text("v -1 0 0\nv 1 0 0\nv 0 0 2\nv 0 1 1\nf 1 2 3\nf 1 2 4\n")
    given = [f"./{file.name}" for file in files]
    result = run_script("compare.py", "--character", *given, "--engine", "cycles", "--job=-job\n", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    job = tmp_path / "-job\n"
    named = json.loads((job / "asset_references.json").read_text())["assetReferences"]["inputs"]["filenames"]
    assert named == list(map(str, files))
    names = list(json.loads((job / "job.json").read_text())["spec"]["characters"])
    assert len(set(names)) == len(stems)
    assert all(0 < len(name.encode()) <= 110 and re.fullmatch(r"[\w][\w.-]*", name) for name in names)
    for file in files:
        file.write_text("v 0 0 0")
    for each in given[2], given[-1]:
        result = run_script("compare.py", "--character", each, cwd=tmp_path)
        assert_bad_input(result, "compare.py: error: ")
        assert result.stderr.removesuffix("\n").isprintable()


def records(path: Path) -> list[dict[str, Any]]:
    """What a comparison measured, but for times."""
    return [{**record, "render_seconds": 0.0} for record in json.loads(path.read_text())["records"]]


def errors(path: Path) -> dict[str, list[float]]:
    """What a report measured, but for times."""
    return {curve["label"]: [point["error"] for point in curve["points"]] for curve in json.loads(path.read_text())["curves"]}


def killed_and_run_again(name: str, *arguments: str | Path, cwd: Path, seconds: float) -> None:
    """Kill a script KILLS times at a moment within `seconds`, the first process or all, then let it end."""
    dice = random.Random(name)
    for _ in range(KILLS):
        process = start(name, *arguments, cwd=cwd, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(dice.uniform(0.0, seconds))
        os.killpg(process.pid, signal.SIGKILL) if dice.random() < 0.5 else process.kill()
        process.wait()
        for path in cwd.rglob("*"):
            if path.suffix in (".json", ".png", ".exr", ".zip") and not any(part.startswith(".") for part in path.parts):
                assert path.stat().st_size > 0, path
                if path.suffix == ".json":
                    json.loads(path.read_text())
    result = run_script(name, *arguments, cwd=cwd)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.slow
@pytest.mark.render
def test_comparison_killed_at_any_moment_gives_the_same(tmp_path: Path) -> None:
    assert run_script("compare.py", *SMALL, "--out", "whole", cwd=tmp_path).returncode == 0
    killed_and_run_again("compare.py", *SMALL, "--out", "out", cwd=tmp_path, seconds=8.0)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == PICTURES
    assert records(tmp_path / "out" / "compare.json") == records(tmp_path / "whole" / "compare.json")


@pytest.mark.slow
@pytest.mark.render
def test_report_killed_at_any_moment_gives_the_same(tmp_path: Path) -> None:
    sphere = ("--quick", "--engine", "cycles", "--scene", "sphere")
    assert run_script("report.py", *sphere, "--out", "whole", cwd=tmp_path).returncode == 0
    killed_and_run_again("report.py", *sphere, "--out", "out", cwd=tmp_path, seconds=5.0)
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["index.html", "report.csv", "report.json"]
    found, expected = errors(tmp_path / "out" / "report.json"), errors(tmp_path / "whole" / "report.json")
    # what was rendered before in a process may turn the last bit of a pixel, which is a 32-bit float around 1
    assert found.keys() == expected.keys()
    assert all(found[label] == pytest.approx(expected[label], rel=1e-6, abs=1e-6) for label in expected)


@pytest.mark.slow
@pytest.mark.render
def test_tasks_killed_at_any_moment_give_the_same(tmp_path: Path) -> None:
    assert run_script("compare.py", *SMALL, "--out", "whole", cwd=tmp_path).returncode == 0
    assert run_script("compare.py", *SMALL, "--job", "job", cwd=tmp_path).returncode == 0
    killed_and_run_again("task.py", "render", "job", cwd=tmp_path, seconds=5.0)
    killed_and_run_again("task.py", "collect", "job", cwd=tmp_path, seconds=2.0)
    assert sorted(path.name for path in (tmp_path / "job" / "output").iterdir()) == [*PICTURES, "items"]
    assert records(tmp_path / "job" / "output" / "compare.json") == records(tmp_path / "whole" / "compare.json")
