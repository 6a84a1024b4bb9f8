# SPDX-License-Identifier: GPL-3.0-or-later
"""Damaged files of every format: a picture or one line and exit status 2, never a traceback, a hang or a crash.

Most are read by one process, which says what came of each, or ends of it. Those that end it are then given to compare.py itself.
"""

import json
import random
import re
import select
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import bpy

import pytest

from support import SCRIPTS, run_script
from true_diffuse.scripts.characters import reading

pytestmark = [pytest.mark.usefixtures("empty_file"), pytest.mark.skipif(sys.platform != "linux", reason="its limits are Linux's")]

FORMATS = ("blend", "usda", "usdc", "glb", "gltf", "obj")
COUNT = 200  # of files for each format
SECONDS = 20  # that reading one of them may take
PATIENCE = 5 * SECONDS  # until this gives up: what a render takes on top
ALSO_WHOLE = 2  # for each format: files of the others that compare.py is given as well
BITS = (1, 4, 16, 64, 256)  # that are flipped


@pytest.fixture
def whole(tmp_path: Path) -> dict[str, Path]:
    """The same character in every format: a ball with an armature, modifiers, a driver, an image and a normal map, and a cube."""
    bpy.ops.object.armature_add()
    rig = bpy.context.object
    material = bpy.data.materials.new("Painted")
    tree = material.node_tree
    image = bpy.data.images.new("Paint", 16, 16)
    image.pack()
    node, normal = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeNormalMap")
    node.image = image
    surface = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfPrincipled")
    for source, target in (
        (node, surface.inputs["Base Color"]),
        (node, normal.inputs["Color"]),
        (normal, surface.inputs["Normal"]),
    ):
        tree.links.new(source.outputs[0], target)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=16, ring_count=8)
    ball = bpy.context.object
    ball.modifiers.new("Subdivision", "SUBSURF")
    ball.modifiers.new("Armature", "ARMATURE").object = rig
    ball.shape_key_add(name="Basis")
    ball.shape_key_add(name="Key").driver_add("value").driver.expression = "frame / 10"
    ball.data.materials.append(material)
    bpy.ops.mesh.primitive_cube_add(location=(0.0, 0.0, 2.0))
    bpy.context.object.data.materials.append(material)
    paths = {suffix: tmp_path / f"whole.{suffix}" for suffix in FORMATS}
    bpy.ops.wm.save_as_mainfile(filepath=str(paths["blend"]), copy=True, compress=False)
    for suffix in ("usda", "usdc"):
        bpy.ops.wm.usd_export(filepath=str(paths[suffix]))
    bpy.ops.export_scene.gltf(filepath=str(paths["glb"]))
    bpy.ops.export_scene.gltf(filepath=str(paths["gltf"]), export_format="GLTF_SEPARATE")
    bpy.ops.wm.obj_export(filepath=str(paths["obj"]), export_materials=False)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return paths


def damaged(content: bytes, dice: random.Random) -> bytes:
    """Return what is left of a file that was cut, or of which bits were flipped."""
    if dice.random() < 0.3:
        return content[: dice.randrange(1, len(content))]
    changed = bytearray(content)
    for _ in range(dice.choice(BITS)):
        changed[dice.randrange(len(changed))] ^= 1 << dice.randrange(8)
    return bytes(changed)


class Reader:
    """A process that reads files and says what came of each."""

    def __init__(self, note: Path) -> None:
        self.note = note
        self.process: subprocess.Popen[str] | None = None

    def ask(self, path: Path) -> str:
        """Return "picture", the line that a user gets, or that the process ended; it is started anew then."""
        if self.process is None:
            command = [sys.executable, Path(__file__).with_name("damaged.py"), self.note, str(SECONDS)]
            self.process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
            )
        assert self.process.stdin and self.process.stdout
        self.process.stdin.write(json.dumps(str(path)) + "\n")
        self.process.stdin.flush()
        ready, _, _ = select.select([self.process.stdout], [], [], PATIENCE)
        assert ready, f"{path} hangs"
        for answer in iter(self.process.stdout.readline, ""):
            if answer.startswith('"'):  # and not what Blender says as it is loaded
                return json.loads(answer)
        status = self.process.wait()
        assert status < 0, f"{path} has a traceback"
        self.process = None
        return f"ended: {status}"

    def end(self) -> None:
        if self.process:
            self.process.kill()
            self.process.wait()


@pytest.fixture
def reader(tmp_path: Path) -> Iterator[Reader]:
    process = Reader(tmp_path / "note")
    yield process
    process.end()


def compare(path: Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    """Run compare.py with a file, with the time limit of this test."""
    script = SCRIPTS / "compare.py"
    small = ["--engine", "cycles", "--resolution", "64x24", "--samples", "1", "--sigma", "0.2", "--out", "out"]
    code = f"import runpy, sys; sys.path.insert(0, {str(SCRIPTS)!r}); import checkout; "
    code += f"from true_diffuse.scripts.characters import reading; reading.SECONDS = {SECONDS}; "
    code += f"sys.argv[0] = {str(script)!r}; runpy.run_path({str(script)!r}, run_name='__main__')"
    command = [sys.executable, "-c", code, "--character", path, *small]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, check=False, timeout=PATIENCE)


def check(result: subprocess.CompletedProcess[str], path: Path, cwd: Path) -> None:
    """Assert that there are pictures, or one line and nothing else."""
    if result.returncode == 0:
        assert (cwd / "out" / "five_cycles.png").exists()
        shutil.rmtree(cwd / "out")
        return
    assert result.returncode == 2, f"{path}: {result.stdout} {result.stderr}"
    assert len(result.stderr.splitlines()) == 1 and result.stderr.startswith("compare.py: error: "), f"{path}: {result.stderr}"
    assert not (cwd / "out").exists()


@pytest.mark.slow
@pytest.mark.render
@pytest.mark.parametrize("suffix", FORMATS)
def test_damaged_file_is_a_picture_or_one_line(suffix: str, whole: dict[str, Path], reader: Reader, tmp_path: Path) -> None:
    dice, content = random.Random(suffix), whole[suffix].read_bytes()
    assert reader.ask(whole[suffix]) == "picture"
    kinds: Counter[str] = Counter()
    for index in range(COUNT):
        path = whole[suffix].with_stem(f"damaged_{index}")
        path.write_bytes(damaged(content, dice))
        answer = reader.ask(path)
        kind = "ended" if answer.startswith("ended") else "picture" if answer == "picture" else "line"
        assert answer.isprintable() and "Traceback" not in answer, answer
        kinds[kind] += 1
        if kind == "ended" or kinds[kind] <= ALSO_WHOLE:
            check(compare(path, tmp_path), path, tmp_path)
    assert kinds["line"] and kinds["picture"]


def test_limits_end_a_process_and_say_of_what(tmp_path: Path) -> None:
    """Hanging in C code that keeps Python from running, and memory beyond the limit."""
    code = f"import sys; sys.path.insert(0, {str(SCRIPTS)!r}); import checkout, pathlib\n"
    code += "from true_diffuse.scripts.characters import reading\n"
    code += f"reading.supervised(pathlib.Path({str(tmp_path / 'note')!r})); reading.SECONDS = 1\n"
    code += "with reading.limited('figure.blend'):\n    {}"
    for work, reason in (
        ("import re; re.match('(a*)*b', 'a' * 99)", r"reading figure\.blend takes too long: .*"),
        ("import os; os.abort()", r"crashed \(SIGABRT\) while reading figure\.blend: .*"),
    ):
        result = subprocess.run([sys.executable, "-c", code.format(work)], check=False, timeout=20, stderr=subprocess.DEVNULL)
        assert re.fullmatch(reason, reading.ending(tmp_path / "note", result.returncode))
    greedy = code.format(
        "import os\n    try:\n        bytearray(os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE'))\n"
        "    except MemoryError:\n        print('no more')\n"
    )
    result = subprocess.run([sys.executable, "-c", greedy], check=True, timeout=20, capture_output=True, text=True)
    assert result.stdout == "no more\n"
    assert not (tmp_path / "note").exists()


@pytest.mark.parametrize(
    "content",
    [
        pytest.param(b"{", marks=pytest.mark.slow),
        pytest.param(b"[]", marks=pytest.mark.slow),
        b'{"version": 2, "curves": [{}], "environment": 3}',
        b"\xff",
    ],
)
def test_damaged_report_and_job_are_one_line(content: bytes, tmp_path: Path) -> None:
    (tmp_path / "job.json").write_bytes(content)
    for name, arguments in (("compare.py", ("--error", "1", "--report", "job.json")), ("task.py", ("render", "."))):
        result = run_script(name, *arguments, cwd=tmp_path)
        assert result.returncode == 2 and len(result.stderr.splitlines()) == 1, result.stderr
