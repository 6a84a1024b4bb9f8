# SPDX-License-Identifier: GPL-3.0-or-later
"""The timing of frames: what is timed draws the same picture, takes turns, and is packed as the driver has it. No times."""

import ctypes
import json
import math
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from true_diffuse.addon.blender.glsl import source
from true_diffuse.addon.models import OrenNayar
from true_diffuse.addon.realtime import blocks, program
from true_diffuse.scripts import bench_glsl
from true_diffuse.scripts.studies import frame_time
from true_diffuse.scripts.studies.frame_time import CONTESTANTS, LAMBERT, OREN_NAYAR, PLAIN, PLAIN_LAMBERT, Setting

SCRIPT = Path(bench_glsl.__file__)
ROUND = 2e-6  # of radiances up to 1, after some ten operations in 32 bits
SIZE = (64, 36)


@contextmanager
def other_context() -> Iterator[None]:
    """Give the process back the OpenGL context it had, if any: Blender's, which goes on as if it were still there."""
    egl = ctypes.CDLL("libEGL.so.1")
    for function in (egl.eglGetCurrentDisplay, egl.eglGetCurrentSurface, egl.eglGetCurrentContext):
        function.restype = ctypes.c_void_p
    egl.eglMakeCurrent.argtypes = [ctypes.c_void_p] * 4
    draw, read = 0x3059, 0x305A  # EGL_DRAW, EGL_READ
    before = (egl.eglGetCurrentDisplay(), *map(egl.eglGetCurrentSurface, (draw, read)), egl.eglGetCurrentContext())
    try:
        yield
    finally:
        display = before[0] or egl.eglGetCurrentDisplay()
        if display:
            egl.eglMakeCurrent(display, *before[1:])


@pytest.fixture(scope="module")
def made():
    pytest.importorskip("moderngl")
    try:
        with other_context():
            return bench_glsl.Stage(bench_glsl.bumpy(24), SIZE)
    except (OSError, bench_glsl.BadInput) as error:  # no libEGL, no driver
        pytest.skip(str(error))


@pytest.fixture
def stage(made):
    with other_context(), made.context:
        yield made


def drawn(stage, name: str) -> list[float]:
    stage.frame(CONTESTANTS[name])
    return list(stage.pixels())


def std140(kind: str) -> int:
    """Return the bytes of a struct of program.py, all of whose members are aligned to 16 bytes."""
    lamp = source("lights").split("struct Lamp {")[1].split("};")[0]
    sizes = {"mat4": 64, "vec4": 16, "ivec4": 16, "Lamp": 16 * lamp.count("vec4")}
    total = 0
    for member in program.STRUCTS[kind].rstrip(";").split(";"):
        name, what = member.split()
        count = int(what.split("[")[1].rstrip("]")) if "[" in what else 1
        total += sizes[name] * count
    return total


UNIT = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
LAMP = blocks.lamp("AREA", (1.0, 2.0, 3.0), (0.0, 0.0, 1.0), (4.0, 5.0, 6.0))
PACKED = {
    "View": blocks.view(UNIT, (0.0, 0.0, 1.0), True, (0.0, 0.0, 0.0)),
    "Material": blocks.material((1.0, 1.0, 1.0), (0.5,), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 0.0)),
    "Exact for Chosen Lights": blocks.lamps([LAMP]),
}


@pytest.mark.parametrize("kind", PACKED)
def test_blocks_are_as_long_as_their_structs(kind: str) -> None:
    assert len(PACKED[kind]) == std140(kind)


def test_blocks_are_as_long_as_the_driver_has_them(stage) -> None:
    compiled = stage._program(CONTESTANTS[OREN_NAYAR])
    for name, kind in (("view_block", "View"), ("material_block", "Material"), ("lamps_block", "Exact for Chosen Lights")):
        assert compiled[name].size == len(PACKED[kind])


def test_lamps_beyond_the_most_are_left_out() -> None:
    assert blocks.lamps([LAMP] * (program.MOST_LAMPS + 3)) == blocks.lamps([LAMP] * program.MOST_LAMPS)


@pytest.mark.parametrize("lamps", [1, 8])
def test_wall_is_as_bright_as_its_models_say(stage, lamps: int) -> None:
    stage.prepare(Setting(lamps))
    width, height = SIZE
    # the middle of the corner pixel on the wall, 14 from the camera, of whose picture 4.3 to either side are seen at 12
    x, y = ((2 * k + 1) / (2 * n) - 1.0 / 2.0 for k, n in ((0, width), (0, height)))
    wide = 2.0 * 4.3 * 14.0 / 12.0
    eye = (-x * wide, -y * wide * height / width, 14.0)
    v = tuple(part / math.hypot(*eye) for part in eye)
    suns = [(x, z, -y) for x, y, z in frame_time.SUNS[:lamps]]
    suns = [tuple(part / math.hypot(*sun) for part in sun) for sun in suns]
    irradiance = math.pi / lamps
    lambert = 0.8 / math.pi * irradiance * sum(l[2] for l in suns)
    model = OrenNayar(frame_time.SIGMA)
    rough = irradiance * sum(model.radiance((0.0, 0.0, 1.0), l, v, 0.8) for l in suns)
    for name, expected in ((LAMBERT, lambert), (PLAIN_LAMBERT, lambert), (OREN_NAYAR, rough), (PLAIN[-1], rough)):
        assert drawn(stage, name)[:4] == pytest.approx([expected] * 3 + [1.0], abs=ROUND), name
    assert abs(rough - lambert) > 0.01


def test_forms_draw_the_same_picture(stage) -> None:
    stage.prepare(Setting(4))
    expected = drawn(stage, OREN_NAYAR)
    lambert = drawn(stage, LAMBERT)
    assert max(abs(a - b) for a, b in zip(expected, lambert, strict=True)) > 0.05
    assert drawn(stage, PLAIN_LAMBERT) == pytest.approx(lambert, abs=ROUND)
    for name in PLAIN[1:]:
        assert drawn(stage, name) == pytest.approx(expected, abs=ROUND), name


def test_detail_keeps_the_shape() -> None:
    mesh = bench_glsl.bumpy(8)
    finer = mesh.cut()
    assert len(mesh.triangles) == 2 * 8 * 16
    assert len(finer.triangles) == 4 * len(mesh.triangles)
    assert finer.points[: len(mesh.points)] == list(mesh.points)
    # Euler's V - E + F of a tube, as the points of a ring are apart at the poles, too
    edges = {frozenset(pair) for a, b, c in finer.triangles for pair in ((a, b), (b, c), (c, a))}
    assert len(finer.points) - len(edges) + len(finer.triangles) == 0


class Counted:
    """A stage whose frames take what a formula says."""

    details = (1.0, 4.0)

    def __init__(self) -> None:
        self.order: list[str] = []
        self.names = {id(law): name for name, law in CONTESTANTS.items()}

    def prepare(self, setting: Setting) -> dict[str, int]:
        self.setting = setting
        return {"width": round(1000 * setting.pixels), "height": 1000, "triangles": round(1e6 * setting.triangles)}

    def frame(self, law) -> dict[str, float]:
        name = self.names[id(law)]
        self.order.append(name)
        rough = 0.5 if name == OREN_NAYAR else 0.25
        setting = self.setting
        return {"readback": 1.0 + rough * setting.lamps * setting.pixels + 2.0 * setting.triangles}


class Told:
    def __init__(self) -> None:
        self.work = 0.0

    def step(self, text: str, work: float):
        from contextlib import nullcontext

        self.work += work
        return nullcontext()

    def within(self, work: float) -> None:
        pass


def test_contestants_take_turns_in_either_order() -> None:
    stage = Counted()
    frame_time.compare(stage, Setting(1), CONTESTANTS, 3, Told())
    names = list(CONTESTANTS)
    assert stage.order == names + names + names[::-1] + names  # the first for the compiler


def test_records_have_the_ratio_and_the_growth_of_what_was_timed() -> None:
    stage, told = Counted(), Told()
    records = list(frame_time.records(stage, (1, 2, 4), 3, True, told))
    assert told.work == pytest.approx(frame_time.work(stage, (1, 2, 4), 3, True))
    (ratio,) = (r["over_lambert"] for r in records if r["law"] == OREN_NAYAR and r.get("lit_by") == "4 suns")
    assert ratio == pytest.approx((3.0 + 0.5 * 4) / (3.0 + 0.25 * 4))
    grown = {r["grows_with"]: (r["start"], r["slope"], r["off"]) for r in records if "grows_with" in r and r["law"] == OREN_NAYAR}
    assert grown["lamps"] == pytest.approx((3.0, 0.5, 0.0))
    assert grown["pixels"] == pytest.approx((3.0, 2.0, 0.0))  # by the million; 4 lamps
    assert grown["triangles"] == pytest.approx((3.0, 2.0, 0.0))
    columns, rows = frame_time.table(records, "readback", False)
    assert columns[1:] == ("1 sun", "2 suns", "4 suns")
    assert [row[0] for row in rows] == list(CONTESTANTS)
    assert not any("ms" in cell for row in rows for cell in row)
    assert all("ms" in cell for row in frame_time.table(records, "readback", True)[1] for cell in row[1:])


@pytest.mark.parametrize(
    ("name", "software"),
    [("llvmpipe (LLVM 15.0.6, 256 bits)", True), ("NVIDIA H200/PCIe/SSE2", False), ("AMD Radeon RX 7900 XTX", False)],
)
def test_software_is_told_from_hardware(name: str, software: bool) -> None:
    assert frame_time.is_software(name) is software


def run(*arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(SCRIPT), *arguments]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=os.environ | environment)


def test_bench_runs_without_blender(stage, tmp_path: Path) -> None:
    (tmp_path / "bpy.py").write_text('raise ImportError("there is no Blender here")')
    mesh, out = tmp_path / "tetrahedron.obj", tmp_path / "out.json"
    mesh.write_text("v 0 0 1\nv 1 0 -1\nv -1 1 -1\nv -1 -1 -1\nf 1 2 3\nf 1/1 3/1 4/1\nf -4 -1 -3\nf 2 4 3\n")
    result = run("--quick", "--resolution", "32x18", "--mesh", str(mesh), "--out", str(out), PYTHONPATH=str(tmp_path))
    assert result.returncode == 0, result.stderr
    assert stage.renderer in result.stdout
    written = json.loads(out.read_text())
    assert written["environment"]["renderer"] == stage.renderer
    assert {record["law"] for record in written["records"]} == set(CONTESTANTS)
    assert all(record["triangles"] == 5 * 4 + 2 and record["seconds"] > 0.0 for record in written["records"])


@pytest.mark.parametrize(
    "arguments",
    [
        ("--lamps", "0"),
        ("--lamps", "9"),
        ("--rounds", "none"),
        ("--resolution", "1920"),
        ("--mesh", "missing.obj"),
        ("--mesh", "empty.obj"),
        ("--mesh", "odd.obj"),
    ],
)
def test_bench_says_in_a_line_what_is_wrong(arguments: tuple[str, str], tmp_path: Path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("empty.obj").write_text("v 0 0 0\n")
    Path("odd.obj").write_text("v 0 0 0\nf 1 2 3\n")
    result = run(*arguments)
    assert result.returncode == 2
    assert result.stderr.startswith("bench_glsl.py: error: ")
    assert len(result.stderr.splitlines()) == 1
    assert not Path("bench_glsl.json").exists()


@pytest.mark.skipif(sys.platform != "linux", reason="how to hide all drivers is known for Linux")
@pytest.mark.usefixtures("stage")
def test_bench_without_a_driver_says_so(tmp_path: Path) -> None:
    result = run("--quick", "--out", str(tmp_path / "out.json"), __EGL_VENDOR_LIBRARY_FILENAMES=os.devnull)
    assert result.returncode == 2
    assert result.stderr.startswith("bench_glsl.py: error: no driver of OpenGL 3.3 through EGL")
    assert not list(tmp_path.iterdir())


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_characters_are_drawn_alike_by_all_forms(eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("Realtime finds no graphics driver here")
    from true_diffuse.scripts.characters import character
    from true_diffuse.scripts.studies import realtime_frames

    stage = realtime_frames.Stage(character.load("monkey"), SIZE)
    sizes = {detail: stage.prepare(Setting(2, triangles=detail))["triangles"] for detail in stage.details}
    # quads are cut into eight triangles of two, and what few triangles there are into six
    assert sizes[4.0] == pytest.approx(4 * sizes[1.0], rel=0.05)
    assert sizes[0.25] == pytest.approx(sizes[1.0] / 4, rel=0.05)

    def picture(name: str) -> list[float]:
        stage.frame(CONTESTANTS[name])
        return list(stage.pixels())

    stage.prepare(Setting(2))
    rough, lambert = picture(OREN_NAYAR), picture(LAMBERT)
    assert max(abs(a - b) for a, b in zip(rough, lambert, strict=True)) > 0.05
    assert picture(PLAIN[-1]) == pytest.approx(rough, abs=2.0 * ROUND)
    assert picture(PLAIN_LAMBERT) == pytest.approx(lambert, abs=2.0 * ROUND)
    assert set(stage.frame(CONTESTANTS[LAMBERT])) == {"readback", "processor"}
