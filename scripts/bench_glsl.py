# SPDX-License-Identifier: GPL-3.0-or-later
"""Times the realtime shaders without Blender: every model and form of equation (1) in turns with Lambert's law.

python scripts/bench_glsl.py [OPTIONS]

Draws five bodies before a wall through EGL, without a window. Needs Python 3.12, moderngl, and a driver of OpenGL 3.3.
"""

import math
import platform
import struct
import sys
import time
from argparse import ArgumentTypeError
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

sys.path.insert(0, str(Path(__file__).resolve().parent))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.addon.realtime import blocks
from true_diffuse.addon.realtime.laws import Law
from true_diffuse.addon.realtime.program import Light, Paint, Variant, declared, surface
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal
from true_diffuse.scripts.cli.outputs import Staging
from true_diffuse.scripts.cli.startup import run_script
from true_diffuse.scripts.studies import frame_time
from true_diffuse.scripts.studies.frame_time import Setting

if TYPE_CHECKING:
    import moderngl

    from true_diffuse.addon.measure.record import Record

RESOLUTION, QUICK_RESOLUTION = (1920, 1080), (480, 270)
LARGEST = 16384  # pixels each way
MOST_LAMPS = len(frame_time.SUNS)
GPU_ROUNDS, MOST_ROUNDS = 101, 10000
RINGS = 192  # of a body, each of twice as many quads: 5 x 147 000 triangles, about as many as the five characters have
BODIES = 5
DISTANCE, WALL = 12.0, -2.0  # of the camera and the wall from the bodies' centers, whose radius is about 1
STEP = 1.6  # between two bodies
ALBEDO = 0.8
IRRADIANCE = math.pi  # of each sun [W/m^2]
BINDINGS = {"view": 0, "material": 1, "lamps": 2}

type Vector = tuple[float, float, float]
type Triangle = tuple[int, int, int]
type Matrix = tuple[tuple[float, float, float, float], ...]
"""Four rows."""


@dataclass(frozen=True)
class Mesh:
    """Points, and triangles of their indices, counterclockwise from outside."""

    points: Sequence[Vector]
    triangles: Sequence[Triangle]

    def packed(self) -> bytes:
        """Return position and normal of each triangle's corners; normals are the mean of those of the faces around, by area."""
        sums = [[0.0, 0.0, 0.0] for _ in self.points]
        for triangle in self.triangles:
            a, b, c = (self.points[corner] for corner in triangle)
            normal = _cross(_minus(b, a), _minus(c, a))
            for corner in triangle:
                for axis in range(3):
                    sums[corner][axis] += normal[axis]
        corners = []
        for point, total in zip(self.points, sums, strict=True):
            length = math.hypot(*total) or 1.0
            corners.append(struct.pack("6f", *point, *(part / length for part in total)))
        return b"".join(corners[corner] for triangle in self.triangles for corner in triangle)

    def cut(self) -> "Mesh":
        """Return the same surface with each triangle cut into four."""
        points, middles = list(self.points), {}

        def middle(a: int, b: int) -> int:
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                (x0, y0, z0), (x1, y1, z1) = points[a], points[b]
                points.append(((x0 + x1) / 2.0, (y0 + y1) / 2.0, (z0 + z1) / 2.0))
            return middles[key]

        triangles = []
        for a, b, c in self.triangles:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            triangles += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        return Mesh(points, triangles)


def bumpy(rings: int) -> Mesh:
    """Return a sphere of about radius 1 with bumps, `rings` quads from pole to pole and twice as many around."""
    around = 2 * rings
    points = []
    for i in range(rings + 1):
        theta = math.pi * i / rings
        for k in range(around):
            phi = math.pi * k / rings
            radius = 1.0 + 0.06 * math.sin(theta) ** 2 * math.sin(7.0 * theta) * math.sin(6.0 * phi)
            sine = radius * math.sin(theta)
            points.append((sine * math.cos(phi), sine * math.sin(phi), radius * math.cos(theta)))
    triangles = []
    for upper, lower in pairwise(range(0, (rings + 1) * around, around)):
        for k in range(around):
            after = (k + 1) % around
            triangles += [(upper + k, lower + k, lower + after), (upper + k, lower + after, upper + after)]
    return Mesh(points, triangles)


def read_obj(file: Path) -> Mesh:
    """Return the faces of a Wavefront .obj file, moved and scaled into a ball of radius 1. Raises BadInput where it has none."""
    points: list[Vector] = []
    triangles: list[Triangle] = []
    try:
        lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
    except OSError as error:
        raise BadInput(f"cannot read {file}: {error.strerror}") from error
    for number, line in enumerate(lines, 1):
        word, *rest = line.split() or ("",)
        try:
            if word == "v":
                x, y, z = map(float, rest[:3])
                points.append((x, y, z))
            elif word == "f":
                corners = [_index(text, len(points)) for text in rest]
                triangles += [(corners[0], b, c) for b, c in pairwise(corners[1:])]
        except ValueError as error:
            raise BadInput(f"{file}, line {number}: {line.strip()!r} is no {'point' if word == 'v' else 'face'}") from error
    if not triangles or not all(math.isfinite(part) for point in points for part in point):
        raise BadInput(f"{file} has no faces of finite points")
    middle = [(min(axis) + max(axis)) / 2.0 for axis in zip(*points, strict=True)]
    radius = max(math.dist(point, middle) for point in points) or 1.0
    x, y, z = middle
    return Mesh([((point[0] - x) / radius, (point[1] - y) / radius, (point[2] - z) / radius) for point in points], triangles)


def _index(text: str, count: int) -> int:
    """Return which of `count` points a corner of a face names; raises ValueError where it names none."""
    number = int(text.split("/")[0])
    index = number - 1 if number > 0 else count + number
    if number == 0 or not 0 <= index < count:
        raise ValueError(text)
    return index


def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def projection(width: int, height: int) -> Matrix:
    """Return the projection from the world to the clip space of a camera at DISTANCE that looks along -z and sees all bodies."""
    half = (BODIES - 1) / 2.0 * STEP + 1.1  # seen to either side, at the bodies
    near, far = DISTANCE / 4.0, DISTANCE * 4.0
    scale = DISTANCE / half
    slope, shift = -(far + near) / (far - near), -2.0 * far * near / (far - near)
    # the translation by -DISTANCE along z is multiplied in
    return (
        (scale, 0.0, 0.0, 0.0),
        (0.0, scale * width / height, 0.0, 0.0),
        (0.0, 0.0, slope, shift - slope * DISTANCE),
        (0.0, 0.0, -1.0, DISTANCE),
    )


def moved(x: float) -> Matrix:
    """Return the matrix that moves by `x` to the right."""
    return (1.0, 0.0, 0.0, x), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0)


class Stage:
    """Five bodies before a wall, all of one law. A frame is one sample of every pixel; reading back one of them ends it."""

    def __init__(self, mesh: Mesh | None, resolution: tuple[int, int]) -> None:
        """Find a driver; raises BadInput where there is none. Without a `mesh` the bodies are bumpy spheres."""
        try:
            import moderngl
        except ImportError as error:
            raise BadInput(f"moderngl cannot be loaded: {error}") from error
        try:
            self.context = moderngl.create_context(standalone=True, backend="egl", require=330)
        except Exception as error:  # what it raises is no narrower
            raise BadInput(f"no driver of OpenGL 3.3 through EGL: {' '.join(str(error).split())}") from error
        self._error = moderngl.Error
        self._source, self._resolution = mesh, resolution
        self.details = (0.25, 1.0, 4.0) if mesh is None else (1.0, 4.0)
        self.renderer, self.version = self.context.info["GL_RENDERER"], self.context.info["GL_VERSION"]
        self._programs: dict[Law, moderngl.Program] = {}
        self._bodies: dict[float, tuple[moderngl.Buffer, int]] = {}
        self._blocks: dict[str, moderngl.Buffer] = {}
        self._target = self._made(*resolution)
        side = 40.0  # beyond the picture's edges
        corners = [(-side, -side, WALL), (side, -side, WALL), (side, side, WALL), (-side, side, WALL)]
        self._wall = self.context.buffer(Mesh(corners, [(0, 1, 2), (0, 2, 3)]).packed())
        self._query = self.context.query(time=True)

    def prepare(self, setting: Setting) -> "Record":
        """As `frame_time.Stage` has it."""
        width, height = (max(1, round(length * math.sqrt(setting.pixels))) for length in self._resolution)
        if self._target.size != (width, height):
            for used in (self._target, *self._target.color_attachments, self._target.depth_attachment):
                used.release()
            self._target = self._made(width, height)
        suns = []
        for towards in frame_time.SUNS[: setting.lamps]:
            length = math.hypot(*towards)
            # the characters' up is z and they are seen along y; here up is y
            x, z, y = towards[0] / length, -towards[1] / length, towards[2] / length
            suns.append(blocks.lamp("SUN", (0.0, 0.0, 0.0), (x, y, z), (IRRADIANCE / setting.lamps,) * 3))
        view = blocks.view(projection(width, height), (0.0, 0.0, DISTANCE), True, (0.0, 0.0, 0.0))
        for buffer in self._blocks.values():
            buffer.release()
        self._blocks = {"view": self.context.buffer(view), "lamps": self.context.buffer(blocks.lamps(suns))}
        self._body, count = self._body_of(setting.triangles)
        return {"width": width, "height": height, "triangles": BODIES * count + 2}

    def frame(self, law: Law) -> frame_time.Times:
        """As `frame_time.Stage` has it. The timer is the driver's, and there only where it tells a time."""
        program = self._program(law)
        shape = law.fold(frame_time.INPUTS)
        material = self.context.buffer(blocks.material((ALBEDO,) * 3, shape, (0.0,) * 3, (0.0,) * 4))
        for name, buffer in (*self._blocks.items(), ("material", material)):
            buffer.bind_to_uniform_block(BINDINGS[name])
        layout = [(buffer, "3f 3f", "position", "normal") for buffer in (self._body, self._wall)]
        body, wall = (self.context.vertex_array(program, [one]) for one in layout)
        program["orientation"] = 1.0
        self._target.use()
        self.context.enable_only(self.context.DEPTH_TEST)
        self.context.finish()
        start = time.perf_counter()
        with self._query:
            self._target.clear(depth=1.0)
            for k in range(BODIES):
                program["object_matrix"].write(blocks.columns(moved((k - (BODIES - 1) / 2.0) * STEP)))
                body.render()
            program["object_matrix"].write(blocks.columns(moved(0.0)))
            wall.render()
        self._target.read(viewport=(0, 0, 1, 1), components=4, dtype="f4")
        seconds = {"readback": time.perf_counter() - start}
        if self._query.elapsed:
            seconds["timer"] = 1e-9 * self._query.elapsed
        for used in (body, wall, material):
            used.release()
        return seconds

    def pixels(self) -> Sequence[float]:
        """Return the last frame: red, green, blue, alpha of each pixel, rows from the bottom."""
        return memoryview(self._target.read(components=4, dtype="f4")).cast("f")

    def _made(self, width: int, height: int) -> "moderngl.Framebuffer":
        """Return what a picture is drawn into. Raises BadInput where the driver has no room for it."""
        try:
            color, depth = self.context.texture((width, height), 4, dtype="f4"), self.context.depth_texture((width, height))
            return self.context.framebuffer([color], depth)
        except self._error as error:
            raise BadInput(f"{self.renderer} has no room for {width} x {height} pixels: {error}") from error

    def _program(self, law: Law) -> "moderngl.Program":
        if law not in self._programs:
            light = Light(frozenset({"SUN"}))
            vertex, fragment = declared(surface(Variant(law, Paint.NOTHING, False, False, False, light)))
            try:
                program = self.context.program(vertex_shader=vertex, fragment_shader=fragment)
            except self._error as error:
                raise BadInput(f"{self.renderer} does not compile {law.stem}.glsl: {' '.join(str(error).split())}") from error
            for name, binding in BINDINGS.items():
                program[f"{name}_block"].binding = binding
            self._programs[law] = program
        return self._programs[law]

    def _body_of(self, detail: float) -> "tuple[moderngl.Buffer, int]":
        """Return a body with `detail` times its triangles on the driver, and how many these are."""
        if detail not in self._bodies:
            mesh = bumpy(round(RINGS * math.sqrt(detail))) if self._source is None else self._source
            if self._source is not None and detail > 1.0:
                mesh = mesh.cut()
            self._bodies[detail] = self.context.buffer(mesh.packed()), len(mesh.triangles)
        return self._bodies[detail]


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="bench_glsl.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--resolution", type=_resolution, metavar="WxH", help="pixels (default: 1920x1080; --quick: 480x270)")
    parser.add_argument("--lamps", type=_lamps, metavar="LIST", help="how many, comma separated (default: 1,2,4,8; --quick: 1)")
    parser.add_argument(
        "--rounds",
        type=_rounds,
        metavar="N",
        help=f"turns of each (default: {GPU_ROUNDS}, in software {frame_time.ROUNDS}; --quick: 2)",
    )
    parser.add_argument("--mesh", type=Path, metavar="FILE", help="an .obj file to draw in place of bumpy spheres")
    parser.add_argument("--quick", action="store_true", help="a small picture, one lamp, two rounds, and not how the cost grows")
    parser.add_argument("--out", type=Path, default=Path("bench_glsl.json"), metavar="FILE", help="default: bench_glsl.json")
    options = parser.parse_args()
    if options.out.is_dir():
        parser.error(f"{options.out} is a folder")
    resolution = options.resolution or (QUICK_RESOLUTION if options.quick else RESOLUTION)
    lamps = options.lamps or ((1,) if options.quick else frame_time.LAMPS)
    rounds = options.rounds or (2 if options.quick else None)
    work = partial(bench, options.mesh, resolution, lamps, rounds, not options.quick, options.out)
    return run_script(parser.prog, options.out.parent, work)


def bench(
    mesh: Path | None,
    resolution: tuple[int, int],
    lamps: Sequence[int],
    rounds: int | None,
    grows: bool,
    out: Path,
    staging: Staging,
    terminal: Terminal,
) -> None:
    """Time all, tell it, and write the records; `rounds` are None for as many as the driver has time for."""
    stage = Stage(read_obj(mesh) if mesh else None, resolution)
    if rounds is None:
        rounds = frame_time.ROUNDS if frame_time.is_software(stage.renderer) else GPU_ROUNDS
    with terminal.progress(frame_time.work(stage, lamps, rounds, grows)) as progress:
        records = list(frame_time.records(stage, lamps, rounds, grows, progress))
    frame_time.tell(records, stage.renderer, terminal)
    environment = {
        "renderer": stage.renderer,
        "driver": stage.version,
        "software": frame_time.is_software(stage.renderer),
        "system": platform.platform(),
        "python": platform.python_version(),
    }
    staging.write_json(out.name, {"records": records, "environment": environment})
    staging.publish()
    terminal.say(f"Wrote {out}")


def _resolution(text: str) -> tuple[int, int]:
    parts = text.lower().split("x")
    if len(parts) != 2 or not all(part.isdecimal() and 1 <= int(part) <= LARGEST for part in parts):
        raise ArgumentTypeError(f"{text!r} is not WIDTHxHEIGHT, each from 1 to {LARGEST}")
    return int(parts[0]), int(parts[1])


def _lamps(text: str) -> tuple[int, ...]:
    parts = text.split(",")
    if not all(part.isdecimal() and 1 <= int(part) <= MOST_LAMPS for part in parts):
        raise ArgumentTypeError(f"{text!r} is not a list of whole numbers from 1 to {MOST_LAMPS}")
    return tuple(dict.fromkeys(int(part) for part in parts))


def _rounds(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= MOST_ROUNDS:
        raise ArgumentTypeError(f"{text!r} is not a whole number from 1 to {MOST_ROUNDS}")
    return int(text)


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    sys.exit(status)
