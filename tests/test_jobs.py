# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs: bundles that Open Job Description's own tools accept and run; tasks that may be killed, repeated and run side by side."""

import json
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from openjd.model import (
    IntRangeExpr,
    StepParameterSpaceIterator,
    create_job,
    decode_job_template,
    preprocess_job_parameters,
)

from support import SCRIPTS, assert_bad_input, run_script, wait_for
from true_diffuse.addon.blender.osl import compiles_osl
from true_diffuse.scripts.cli import inputs
from true_diffuse.scripts.cli.console import BadInput, Show
from true_diffuse.scripts.farm import worker
from true_diffuse.scripts.farm.results import Results
from true_diffuse.scripts.studies.comparison.outcomes import WorkError

SMALL = ("--character", "monkey", "--engine", "cycles", "--resolution", "96x36", "--samples", "2")
LOOKS = ("picture", "specular", "lambert", "oren_nayar_0", "oren_nayar_0.2", "oren_nayar_0.33")
posix = pytest.mark.skipif(os.name != "posix", reason="Windows has no such signals and limits")


def openjd(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "openjd", *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=cwd)


def ordered(cwd: Path, *arguments: str) -> Path:
    """A job's folder, as compare.py has written it."""
    result = run_script("compare.py", "--job", "job", *arguments, cwd=cwd)
    assert result.returncode == 0, result.stderr
    return cwd / "job"


def records(folder: Path) -> list[dict[str, Any]]:
    """The records of a comparison, without times, and those of Realtime against Cycles."""
    document = json.loads((folder / "compare.json").read_text())
    found = document["records"] + document.get("realtime_from_cycles", [])
    return [{name: value for name, value in record.items() if name != "render_seconds"} for record in found]


@pytest.fixture(scope="module")
def at_once(tmp_path_factory: pytest.TempPathFactory) -> list[dict[str, Any]]:
    """The records of SMALL, rendered by compare.py itself."""
    folder = tmp_path_factory.mktemp("at_once")
    result = run_script("compare.py", *SMALL, "--out", "out", cwd=folder)
    assert result.returncode == 0, result.stderr
    return records(folder / "out")


@given(st.lists(st.integers(-50, 50), min_size=1))
def test_frames_are_read_and_written_as_open_job_description_does(numbers: list[int]) -> None:
    frames = tuple(sorted(set(numbers)))
    text = inputs.frame_range(frames)
    assert tuple(IntRangeExpr.from_str(text)) == frames == inputs.frame_numbers(text)


@pytest.mark.parametrize("text", ["1-24", "1-24:4", "5", "-3--1", "1,5,9-12", "-10-10:5"])
def test_frame_ranges_mean_what_they_do_there(text: str) -> None:
    assert inputs.frame_numbers(text) == tuple(IntRangeExpr.from_str(text))


def test_characters_are_files_patterns_and_what_is_included(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("b.glb", "a.glb", "deep/er/a.glb", "note.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    monkeypatch.chdir(tmp_path)
    found = inputs.named_characters(["*.glb", "human", "deep/../a.glb", "**/er/*.glb"], ["human"])
    assert found == {
        "a": str(tmp_path / "a.glb"),
        "b": str(tmp_path / "b.glb"),
        "human": "human",
        "a_2": str(tmp_path / "deep/er/a.glb"),
    }
    with pytest.raises(BadInput, match=r"no file matches \*\.usd"):
        inputs.named_characters(["*.usd"], [])


def test_bundle_passes_open_job_descriptions_checks(tmp_path: Path) -> None:
    for name in ("one.glb", "two.glb"):
        (tmp_path / name).write_text('{"asset": {"version": "2.0"}}')
    job = ordered(tmp_path, "--character", "*.glb", "monkey", "--frames", "1-20", "--chunk", "8")
    assert sorted(path.name for path in job.iterdir()) == [
        "asset_references.json",
        "job.json",
        "parameter_values.json",
        "template.json",
        "true_diffuse",
    ]
    result = openjd("check", job / "template.json", cwd=tmp_path)
    assert result.returncode == 0, result.stdout + result.stderr
    summary = openjd("summary", job / "template.json", "--output", "json", cwd=tmp_path)
    steps = {step["name"]: step["total_tasks"] for step in json.loads(summary.stdout)["steps"]}
    # 3 characters, 20 frames, 3 engines, the picture and 5 looks; the frames go in chunks of 8
    assert steps == {"render": 3 * 20 * 3 * 6, "map": 3 * 20 * 3, "collect": 1}
    template = decode_job_template(template=json.loads((job / "template.json").read_text()), supported_extensions=["TASK_CHUNKING"])
    values = preprocess_job_parameters(
        job_template=template, job_parameter_values={}, job_template_dir=job, current_working_dir=tmp_path
    )
    tasks = list(
        StepParameterSpaceIterator(space=create_job(job_template=template, job_parameter_values=values).steps[0].parameterSpace)
    )
    assert len(tasks) == 3 * 3 * 3 * 6
    references = json.loads((job / "asset_references.json").read_text())["assetReferences"]
    assert references["inputs"]["filenames"] == [str(tmp_path / name) for name in ("one.glb", "two.glb")]
    assert json.loads((job / "parameter_values.json").read_text()) == {"parameterValues": []}


def test_report_bundle_passes_open_job_descriptions_checks(tmp_path: Path) -> None:
    result = run_script("report.py", "--job", "job", "--quick", "--character", "human", "monkey", "--out", "results", cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    assert openjd("check", "job/template.json", cwd=tmp_path).returncode == 0
    template = json.loads((tmp_path / "job" / "template.json").read_text())
    after = {step["name"]: [one["dependsOn"] for one in step.get("dependencies", ())] for step in template["steps"]}
    renders = [f"render {scene}" for scene in ("sphere", "furnace", "five", "face")]
    assert after["collect"] == renders and after["render five"] == ["reference five"] and after["render sphere"] == []
    values = json.loads((tmp_path / "job" / "parameter_values.json").read_text())["parameterValues"]
    assert values == [{"name": "OutputDir", "value": str(tmp_path / "results")}]


@pytest.mark.render
def test_whole_job_gives_what_one_run_gives(tmp_path: Path, at_once: list[dict[str, Any]]) -> None:
    job = ordered(tmp_path, *SMALL)
    result = openjd("run", job / "template.json", "--output", "json", cwd=tmp_path)
    assert result.returncode == 0, result.stdout[-2000:] + result.stderr
    assert json.loads(result.stdout)["chunks_run"] == 6 + 1 + 1
    assert records(job / "output") == at_once
    written = sorted(path.name for path in (job / "output").iterdir())
    assert written == ["compare.json", "error_cycles.png", "five_cycles.exr", "five_cycles.png", "items"]


@pytest.mark.slow
@pytest.mark.render
def test_whole_job_in_all_engines_gives_what_one_run_gives(tmp_path: Path, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("EEVEE and Realtime find no graphics driver here")
    order = (*SMALL, "--engine", "eevee,cycles,realtime", "--frames", "3,5")
    assert run_script("compare.py", *order, "--out", "out", cwd=tmp_path).returncode == 0
    job = ordered(tmp_path, *order, "--chunk", "1")
    result = openjd("run", job / "template.json", cwd=tmp_path)
    assert result.returncode == 0, result.stdout[-2000:]
    assert records(job / "output") == records(tmp_path / "out")
    # two frames: five looks in each engine and in Realtime against Cycles, there the four that have a shader also against that with
    # OSL, and the standard specular against Exact for Chosen Lights
    assert len(records(job / "output")) == 2 * (3 * 5 + 5 + 4 + 1)


@pytest.mark.slow
def test_realtime_and_cycles_are_held_against_each_other_whoever_did_which(tmp_path: Path, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("Realtime finds no graphics driver here")
    order = (*SMALL, "--engine", "cycles,realtime", "--sigma", "0.2")
    assert run_script("compare.py", *order, "--out", "out", cwd=tmp_path).returncode == 0
    job = ordered(tmp_path, *order)
    for engine in ("realtime", "cycles"):  # each in a Blender of its own, one after the other
        done = run_script("task.py", "render", job, "--engine", engine, cwd=tmp_path)
        assert done.returncode == 0, done.stdout + done.stderr
    assert run_script("task.py", "collect", job, cwd=tmp_path).returncode == 0
    assert records(job / "output") == records(tmp_path / "out")
    compared = {(one["name"], one["osl"], one["quality"]) for one in records(job / "output") if "rms_difference" in one}
    rough = ("lambert", "oren_nayar_0.2")  # the standard specular has no shader in OSL
    specular = {("specular", False, mode) for mode in (None, "Exact for Chosen Lights")}
    assert compared == specular | {(name, osl, None) for name in rough for osl in (False, compiles_osl())}
    assert (job / "output" / "error_realtime.png").exists()


@pytest.mark.render
def test_report_job_by_hand(tmp_path: Path) -> None:
    order = ("--quick", "--engine", "cycles", "--scene", "sphere", "--job", "job")
    assert run_script("report.py", *order, cwd=tmp_path).returncode == 0
    assert run_script("task.py", "render", "job", cwd=tmp_path).returncode == 0
    assert run_script("task.py", "collect", "job", cwd=tmp_path).returncode == 0
    document = json.loads((tmp_path / "job" / "output" / "report.json").read_text())
    floors = {curve["label"].removeprefix("Rough Diffuse, "): curve["floor"] for curve in document["curves"]}
    # as of a report at once: lamps are exact, lobes within 1 %, Lambert off by the model's whole effect
    assert floors["Exact for Chosen Lights"] < 0.001 < floors["Balanced"] < 0.01 < 0.1 < floors["Lambert"]
    assert (tmp_path / "job" / "output" / "index.html").read_text().count("Rough Diffuse, Exact for Chosen Lights") >= 2


@pytest.mark.slow
@pytest.mark.render
def test_report_job_gives_the_errors_of_one_run(tmp_path: Path) -> None:
    order = ("--quick", "--engine", "cycles", "--scene", "sphere,five", "--character", "monkey")
    assert run_script("report.py", *order, "--out", "out", cwd=tmp_path).returncode == 0
    assert run_script("report.py", *order, "--job", "job", cwd=tmp_path).returncode == 0
    result = openjd("run", "job/template.json", cwd=tmp_path)
    assert result.returncode == 0, result.stdout[-2000:]
    one, many = (json.loads((tmp_path / place / "report.json").read_text()) for place in ("out", "job/output"))

    def errors(document: dict[str, Any]) -> dict[tuple[str, str], list[tuple[int, float, float]]]:
        names = ("samples", "error_low", "error_high")
        return {(c["scene"], c["label"]): [tuple(p[name] for name in names) for p in c["points"]] for c in document["curves"]}

    assert errors(many) == errors(one) and len(errors(one)) > 10


@pytest.mark.slow
@pytest.mark.render
def test_face_job_gives_what_one_run_gives(tmp_path: Path, eevee_runs_here: bool) -> None:
    engines = "eevee,cycles,realtime" if eevee_runs_here else "cycles"
    order = ("--scene", "face", "--character", "monkey", "--engine", engines, "--resolution", "150x60", "--samples", "2")
    assert run_script("compare.py", *order, "--out", "out", cwd=tmp_path).returncode == 0
    job = ordered(tmp_path, *order)
    result = openjd("run", job / "template.json", cwd=tmp_path)
    assert result.returncode == 0, result.stdout[-2000:]
    assert records(job / "output") == records(tmp_path / "out")
    assert len(records(job / "output")) > 3 and (job / "output" / "face_cycles.png").exists()


@posix
@pytest.mark.render
def test_two_sessions_one_killed_and_run_again_give_what_one_run_gives(tmp_path: Path, at_once: list[dict[str, Any]]) -> None:
    job = ordered(tmp_path, *SMALL)
    parts = job / "output" / "items" / "monkey" / "still"
    run = [sys.executable, "-m", "openjd", "run", job / "template.json", "--step", "render", "--tasks"]
    shares = [json.dumps([{"Character": 0, "Engine": "cycles", "Look": look} for look in LOOKS[start::2]]) for start in (0, 1)]
    sessions = [subprocess.Popen([*run, share], stdout=subprocess.DEVNULL, start_new_session=True) for share in shares]
    first = wait_for(lambda: list(parts.glob(f"cycles_{LOOKS[0]}.zip")))[0]
    sessions[0].send_signal(signal.SIGKILL)  # in the middle of its second task, or near it
    assert sessions[1].wait(timeout=120) == 0
    sessions[0].wait()
    assert (parts / f"cycles_{LOOKS[1]}.zip").exists()
    (parts / ".cycles_lambert.zip.0.tmp").write_text("half of an arch")  # what a kill at the worst moment leaves
    kept = first.read_bytes()

    again = openjd("run", job / "template.json", "--step", "collect", "--run-dependencies", cwd=tmp_path)
    assert again.returncode == 0, again.stdout[-2000:]
    assert first.read_bytes() == kept  # was done, and is not done again
    assert records(job / "output") == at_once


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A job of two frames whose parts are done, by hand."""
    folder = tmp_path_factory.mktemp("done")
    job = ordered(folder, *SMALL, "--sigma", "0.2", "--frames", "1-2")
    result = run_script("task.py", "render", job, cwd=folder)
    assert result.returncode == 0, result.stdout + result.stderr
    progress = [float(line.split()[1]) for line in result.stdout.splitlines() if line.startswith("openjd_progress: ")]
    assert progress == sorted(progress) and progress[0] >= 0.0 and progress[-1] == 100.0 and len(progress) > 10
    assert any(line.startswith("openjd_status: ") for line in result.stdout.splitlines())
    return job


@pytest.mark.render
def test_collect_names_what_is_missing_or_damaged(done: Path) -> None:
    assert run_script("task.py", "collect", done, cwd=done).returncode == 0
    assert len(records(done / "output")) == 2 * 3
    parts = done / "output" / "items" / "monkey"
    missing, cut, record = (parts / "0001" / f"cycles_{look}.zip" for look in ("lambert", "specular", "oren_nayar_0.2"))
    picture, no_archive = (parts / "0002" / f"cycles_{look}.zip" for look in ("picture", "lambert"))
    before = {path: path.read_bytes() for path in (missing, cut, record, picture, no_archive)}
    missing.unlink()
    cut.write_bytes(before[cut][:-20])
    record.write_bytes(before[record].replace(b'"samples": 2', b'"samples": 3'))
    middle = len(before[picture]) // 2  # within the pixels of the linear picture
    picture.write_bytes(before[picture][:middle] + bytes([before[picture][middle] ^ 1]) + before[picture][middle + 1 :])
    no_archive.write_bytes(b"")
    try:
        result = run_script("task.py", "collect", done, cwd=done)
    finally:
        for path, content in before.items():
            path.write_bytes(content)
    assert result.returncode == 1
    said = result.stdout.splitlines()
    assert {line for line in said if line.startswith("monkey/")} == {
        "monkey/0001/cycles_specular is damaged",
        "monkey/0001/cycles_lambert is missing",
        "monkey/0001/cycles_oren_nayar_0.2 is damaged",
        "monkey/0002/cycles_picture is damaged",
        "monkey/0002/cycles_lambert is damaged",
    }
    assert "openjd_fail: 5 work items are missing or damaged" in said


@pytest.mark.render
def test_results_of_another_job_do_not_count(done: Path, tmp_path: Path) -> None:
    job = ordered(tmp_path, *SMALL, "--sigma", "0.2", "--frames", "1-2", "--albedo", "0.5")
    result = run_script("task.py", "collect", job, "--out", done / "output", cwd=tmp_path)
    assert result.returncode == 1 and result.stdout.count("is of another job") == 2 * 5


@pytest.mark.render
def test_task_names_a_file_that_vanished_and_one_that_is_elsewhere(tmp_path: Path) -> None:
    triangle = "v -1 0 0\nv 1 0 0\nv 0 0 2\nv 0 1 1\nf 1 2 3\nf 1 2 4\n"
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "figure.obj").write_text(triangle)
    job = ordered(tmp_path, *SMALL[2:], "--character", "here/figure.obj", "--sigma", "0")
    (tmp_path / "here").rename(tmp_path / "there")
    task = ("task.py", "render", job, "--character", "0", "--look", "lambert")
    result = run_script(*task, cwd=tmp_path)
    assert result.returncode == 1
    assert f"{tmp_path / 'here' / 'figure.obj'} does not exist" in next(fails(result.stdout))
    assert not list((job / "output").glob("**/*.zip"))
    rule = {"source_path_format": "POSIX", "source_path": str(tmp_path / "here"), "destination_path": str(tmp_path / "there")}
    (tmp_path / "rules.json").write_text(json.dumps({"version": "pathmapping-1.0", "path_mapping_rules": [rule]}))
    result = run_script(*task, "--path-mapping", tmp_path / "rules.json", cwd=tmp_path)
    assert result.returncode == 0, result.stdout


@pytest.mark.render
@pytest.mark.parametrize(("key", "label"), [("eevee", "EEVEE"), pytest.param("realtime", "Realtime", marks=pytest.mark.slow)])
def test_worker_without_a_graphics_driver_says_so(key: str, label: str, tmp_path: Path) -> None:
    job = ordered(tmp_path, *SMALL, "--engine", f"{key},cycles", "--sigma", "0")
    hidden = {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere", "DISPLAY": ""}
    failed = run_script("task.py", "render", job, "--engine", key, "--look", "lambert", cwd=tmp_path, **hidden)
    if failed.returncode == 0:
        pytest.skip("this driver cannot be hidden")
    assert failed.returncode == 1 and f"{label} does not run on this machine" in next(fails(failed.stdout))


@posix
def test_full_disk_is_one_line_and_leaves_nothing(tmp_path: Path) -> None:
    # files may not grow beyond 4 kB: as a disk without room for more, with another error
    code = f"""
import resource, sys
sys.path.insert(0, {str(SCRIPTS)!r})
import checkout
from pathlib import Path
from true_diffuse.scripts.farm.results import Results, WorkError
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, 4096))
try:
    Results(Path({str(tmp_path)!r}), "job").keep("a/part", {{"figure": 1}}, {{"exr": bytes(10_000)}})
except WorkError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout == f"cannot write {tmp_path / 'a' / 'part.zip'}: File too large\n"
    assert not list((tmp_path / "a").iterdir())


def fails(output: str) -> Iterator[str]:
    return (line for line in output.splitlines() if line.startswith("openjd_fail: "))


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("compare.py", ("--job", "taken")),
        ("compare.py", ("--job", "a_file")),
        ("compare.py", ("--job", "new", "--character", "gone.blend")),
        ("compare.py", ("--job", "new", "--character", "*.glb")),
        ("compare.py", ("--job", "new", "--chunk", "0")),
        ("compare.py", ("--job", "new", "--save-blend")),
        ("compare.py", ("--job", "new", "--scene", "searchlight")),
        ("report.py", ("--job", "new", "--character", "gone.blend")),
        ("report.py", ("--character", "human", "monkey")),
        ("task.py", ("render", "gone")),
        ("task.py", ("render", "taken")),
        ("task.py", ("begin", "taken")),
        ("task.py", ("paint", "taken")),
    ],
    ids=str,
)
def test_bad_input_is_one_line_and_status_2(name: str, arguments: Sequence[str], tmp_path: Path) -> None:
    (tmp_path / "a_file").touch()
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "job.json").write_text("no JSON")
    before = sorted(tmp_path.rglob("*"))
    result = run_script(name, *arguments, cwd=tmp_path)
    assert_bad_input(result, name)
    assert sorted(tmp_path.rglob("*")) == before


def test_results_are_whole_whoever_writes_them_at_the_same_time(tmp_path: Path) -> None:
    def write(seed: int) -> None:
        chance = random.Random(seed)
        for _ in range(20):
            Results(tmp_path, "job").keep("part", {"writer": seed}, {"bin": chance.randbytes(20_000)})

    threads = [threading.Thread(target=write, args=(seed,)) for seed in range(4)]
    for thread in threads:
        thread.start()
    seen = 0
    while any(thread.is_alive() for thread in threads):
        if (tmp_path / "part.zip").exists():
            assert Results(tmp_path, "job").record("part")["writer"] in range(4)
            seen += 1
    assert seen > 0 and not list(tmp_path.glob(".*"))


@pytest.fixture
def session(tmp_path: Path) -> Iterator[Path]:
    """A session's folder with a worker that counts, fails, or goes on while its task is gone."""
    finished = tmp_path / "finished"

    def do(request: worker.Request, show: Show) -> list[str]:
        if request["wish"] == "fail":
            raise WorkError("no such wish")
        if request["wish"] == "incomplete":
            raise WorkError("2 are not whole", ["a is missing", "b is damaged"])
        for count in range(100):
            show(float(count), "counting")
            time.sleep(0.001)
        finished.touch()
        return ["counted"]

    folder = tmp_path / "session"
    folder.mkdir()
    thread = threading.Thread(target=worker.serve, args=(folder, os.getpid(), do))
    thread.start()
    wait_for(lambda: (folder / worker.ADDRESS).exists())
    yield folder
    for path in folder.iterdir():
        path.unlink()
    folder.rmdir()  # ends it
    thread.join(timeout=3.0 * worker.LOOK_SECONDS)
    assert not thread.is_alive()


def ignore(*_step: object) -> None:
    pass


def test_worker_tells_progress_results_and_failures(session: Path) -> None:
    shown: list[tuple[float, str]] = []
    assert worker.ask(session, {"wish": "count"}, lambda *step: shown.append(step)) == ["counted"]
    assert shown == [(float(count), "counting") for count in range(100)]
    with pytest.raises(WorkError, match="no such wish"):
        worker.ask(session, {"wish": "fail"}, ignore)
    with pytest.raises(WorkError, match="2 are not whole") as caught:
        worker.ask(session, {"wish": "incomplete"}, ignore)
    assert caught.value.details == ["a is missing", "b is damaged"]


def test_worker_ends_what_it_began_and_knows_its_clients(session: Path) -> None:
    class Gone(Exception):
        pass

    def leave(*_step: object) -> None:
        raise Gone

    with pytest.raises(Gone):
        worker.ask(session, {"wish": "count"}, leave)
    wait_for(lambda: (session.parent / "finished").exists())
    address = session / worker.ADDRESS
    right = address.read_text()
    address.write_text(json.dumps({**json.loads(right), "word": "guess"}))
    with pytest.raises(ConnectionError):
        worker.ask(session, {"wish": "count"}, ignore)
    address.write_text(right)
    assert worker.ask(session, {"wish": "count"}, ignore) == ["counted"]


def test_worker_that_dies_at_its_start_says_its_last_words(tmp_path: Path) -> None:
    with pytest.raises(WorkError, match="ended at its start: no display"):
        worker.begin(tmp_path, [sys.executable, "-c", "print('no display')"])
    with pytest.raises(ConnectionError):
        worker.ask(tmp_path, {}, ignore)
