# SPDX-License-Identifier: GPL-3.0-or-later
"""The realtime engine where something is missing, broken or too large: a message, the rest of the picture, and no leak."""

import gc
import math
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace

import bpy

import bmesh
import gpu
import pytest
from mathutils import Matrix

import checkout
from true_diffuse.addon.blender import engines, properties
from true_diffuse.addon.material import materials
from true_diffuse.addon.measure.render import passes as render_passes
from true_diffuse.addon.nodes import ROUGH_DIFFUSE, SUBSURFACE
from true_diffuse.addon.realtime import (
    driver,
    driver_scene,
    engine,
    meshes,
    not_drawn,
    renderer,
    scene_cache,
    shadow_maps,
    shadows,
    view,
    viewport,
)
from true_diffuse.addon.realtime import register as register_engine
from true_diffuse.addon.realtime import unregister as unregister_engine

WIDTH, HEIGHT = 48, 32
LIT = 0.8 / math.pi  # radiance of a face without a material that a sun of 1 W/m^2 shines straight at
NUMBERS = (math.nan, math.inf, -math.inf, 3e38)

pytestmark = pytest.mark.render

# Renders a square under a sun and prints what became of it.
WITHOUT_DRIVER = f"""
import sys
sys.path.insert(0, {str(Path(checkout.__file__).parent)!r})
import checkout, bpy
from true_diffuse.addon import realtime
from true_diffuse.addon.blender import properties
bpy.ops.wm.read_factory_settings()
properties.register()
realtime.register()
bpy.context.scene.render.engine = "TRUE_DIFFUSE_REALTIME"
try:
    bpy.ops.render.render(write_still=True)
    print("rendered")
except RuntimeError as error:
    print(error)
"""

# Renders with a Grease Pencil object, after a render with Cycles too, and without it; prints what became of it. Then with one in
# front of the cube in the middle, 4 m towards the camera, and behind it, 4 m away: prints whether the picture's middle changes.
GREASE_PENCIL = f"""
import sys
sys.path.insert(0, {str(Path(checkout.__file__).parent)!r})
import checkout, bpy
from true_diffuse.addon import realtime
from true_diffuse.addon.blender import properties
bpy.ops.wm.read_factory_settings()
properties.register()
realtime.register()
scene = bpy.context.scene
scene.render.resolution_x = scene.render.resolution_y = 16
scene.cycles.samples = 1
bpy.ops.object.grease_pencil_add(type="STROKE")
drawing = bpy.context.object
for engine in ("TRUE_DIFFUSE_REALTIME", "CYCLES", "TRUE_DIFFUSE_REALTIME", ""):
    if engine:
        scene.render.engine = engine
    else:
        bpy.data.objects.remove(drawing)
        scene.render.engine = "TRUE_DIFFUSE_REALTIME"
    try:
        bpy.ops.render.render()
        print("rendered")
    except RuntimeError as error:
        print(error)
scene.render.filepath = sys.argv[1]

def middle():
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(sys.argv[1])
    pixel = image.pixels[4 * (16 * 8 + 8) :][:3]
    bpy.data.images.remove(image)
    return pixel

plain = middle()
for distance in (4.0, -4.0):
    bpy.ops.object.grease_pencil_add(type="MONKEY", radius=3.0, location=scene.camera.location.normalized() * distance)
    drawing = bpy.context.object
    drawing.show_in_front = False
    print("differs" if middle() != plain else "equal")
    bpy.data.objects.remove(drawing)
"""

# Prints the middle pixel of each part of an EXR file, with the package openimageio, in a process without bpy.
LAYERS = """
import sys, OpenImageIO as oiio
source, part = oiio.ImageInput.open(sys.argv[1]), 0
while source.seek_subimage(part, 0):
    pixels = source.read_image("float")
    print(*pixels[len(pixels) // 2][len(pixels[0]) // 2])
    part += 1
"""


@pytest.fixture(scope="module", autouse=True)
def registered_once() -> Iterator[None]:
    properties.register()
    register_engine()
    yield
    unregister_engine()
    properties.unregister()


@pytest.fixture(autouse=True)
def empty_scene(request, monkeypatch) -> None:
    if request.node.name != "test_without_a_graphics_driver_a_render_says_so":
        request.getfixturevalue("driver")
    bpy.ops.wm.read_factory_settings(use_empty=True)
    monkeypatch.setattr(shadows, "MAP_SIZE", 512)  # a graphics driver in software is slow with more


class Stage:
    """A camera 5 m above the origin, which sees 4 m across, and a sun behind it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.scene = bpy.context.scene
        render = self.scene.render
        render.engine = engine.IDENTIFIER
        self.scene.true_diffuse.samples, self.scene.true_diffuse.bounces_light = 1, False
        render.resolution_x, render.resolution_y = WIDTH, HEIGHT
        render.filepath = str(folder / "picture.exr")
        render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
        self.camera = self.link(bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera")))
        self.camera.location.z = 5.0
        self.camera.data.type, self.camera.data.ortho_scale = "ORTHO", 4.0
        self.scene.camera = self.camera
        self.sun = self.light(1.0)

    def link(self, item: bpy.types.Object) -> bpy.types.Object:
        self.scene.collection.objects.link(item)
        return item

    def light(self, energy: float, kind: str = "SUN") -> bpy.types.Object:
        """Add a light of `energy` in W/m^2 for a sun, W for others."""
        item = self.link(bpy.data.objects.new("Light", bpy.data.lights.new("Light", kind)))
        item.data.energy = energy
        return item

    def mesh(self, corners: list, faces: list, edges: tuple = ()) -> bpy.types.Object:
        data = bpy.data.meshes.new("Mesh")
        data.from_pydata(corners, edges, faces)
        return self.link(bpy.data.objects.new("Mesh", data))

    def square(self, size: float = 1.0, x: float = 0.0) -> bpy.types.Object:
        """Add a square on the ground, `size` its half, and return it."""
        corners = [(x + sx * size, sy * size, 0.0) for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        return self.mesh(corners, [(0, 1, 2, 3)])

    def render(self, name: str = "picture") -> "Picture":
        path = self.folder / f"{name}.exr"
        path.unlink(missing_ok=True)
        bpy.ops.render.render(write_still=True)
        return Picture(path)

    def refusal(self) -> str:
        """Render, which must fail and write nothing; return what Blender reports."""
        with pytest.raises(RuntimeError) as caught:
            self.render()
        assert not (self.folder / "picture.exr").exists()
        return str(caught.value)


class Picture:
    """Pixels of a file."""

    def __init__(self, path: Path) -> None:
        image = bpy.data.images.load(str(path))
        (self.width, self.height), self.pixels = image.size, image.pixels[:]
        bpy.data.images.remove(image)

    def at(self, x: float, y: float = 0.0) -> tuple[float, ...]:
        """Return red, green, blue, alpha at a place on the ground [m], where WIDTH pixels show 4 m."""
        column, row = (int(length * WIDTH / 4.0 + size / 2.0) for length, size in ((x, self.width), (y, self.height)))
        return self.pixels[4 * (row * self.width + column) :][:4]

    def row(self) -> list[float]:
        """Return red along the middle row."""
        start = 4 * self.width * (self.height // 2)
        return list(self.pixels[start : start + 4 * self.width : 4])


@pytest.fixture
def stage(tmp_path: Path) -> Stage:
    return Stage(tmp_path)


def pink() -> object:
    """Return what a pixel of a missing image is in Blender."""
    return pytest.approx((1.0 / math.pi, 0.0, 1.0 / math.pi, 1.0), rel=2e-6)


def gray(radiance: float) -> object:
    """Return what a pixel of that radiance is, to a few roundings of 32 bits."""
    return pytest.approx((radiance, radiance, radiance, 1.0), rel=2e-6)


def warnings(capfd) -> list[str]:
    """Return the warnings that Blender has printed since the last time."""
    lines = capfd.readouterr()
    return [line.removeprefix("Warning: ") for line in (lines.out + lines.err).splitlines() if line.startswith("Warning: ")]


# ---- no picture, but a message


def test_without_a_graphics_driver_a_render_says_so() -> None:
    hidden = os.environ | {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nowhere", "DISPLAY": ""}
    result = subprocess.run([sys.executable, "-c", WITHOUT_DRIVER], capture_output=True, text=True, check=False, env=hidden)
    if "rendered" in result.stdout:
        pytest.skip("this driver cannot be hidden")
    assert result.returncode == 0, result.stderr
    assert result.stdout.splitlines()[-2:] == ["Error: No graphics driver is found here", ""]


def test_grease_pencil_leaves_a_graphics_context_and_is_hidden_by_what_is_before_it(tmp_path: Path) -> None:
    """Blender makes a context of its own to draw Grease Pencil, and takes the one that was there; it draws by the pass Depth."""
    command = [sys.executable, "-c", GREASE_PENCIL, str(tmp_path / "picture.png")]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    said = [line for line in result.stdout.splitlines() if line in {"rendered", "differs", "equal"} or "Error" in line]
    assert said == ["rendered"] * 4 + ["differs", "equal"], result.stderr


def too_large(stage: Stage) -> None:
    # more than any driver's textures have today; 16384 x 16384, which this refuses for its memory, another may grant
    stage.scene.render.resolution_x = 65536


def panoramic(stage: Stage) -> None:
    stage.camera.data.type = "PANO"


def no_camera_object(stage: Stage) -> None:
    stage.scene.camera = stage.sun


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (too_large, f"The graphics driver has no room for a picture of 65536 x {HEIGHT} pixels"),
        (panoramic, "Camera is neither a perspective nor an orthographic camera"),
        (no_camera_object, "Light is neither a perspective nor an orthographic camera"),
    ],
)
def test_picture_that_cannot_be_drawn_is_refused_and_the_next_render_works(
    stage: Stage, spoil: Callable[[Stage], None], message: str
) -> None:
    stage.square()
    spoil(stage)
    assert stage.refusal() == f"Error: {message}\n"
    stage.scene.render.resolution_x, stage.camera.data.type, stage.scene.camera = WIDTH, "ORTHO", stage.camera
    assert stage.render().at(0.0) == gray(LIT)


@pytest.mark.parametrize("error", [SystemError, ReferenceError, RuntimeError])
@pytest.mark.parametrize(
    "name",
    ["types.GPUTexture", "types.GPUVertBuf", "types.GPUUniformBuf", "types.GPUBatch", "shader.create_from_info", "state.blend_set"],
)
def test_lost_context_is_a_message_and_the_next_render_works(stage: Stage, monkeypatch, name: str, error: type[Exception]) -> None:
    """The gpu module then raises an error wherever it is called."""
    stage.square()
    stage.render()
    driver.forget_shaders()

    def lose(*_: object, **__: object) -> None:
        raise error("no context")

    with monkeypatch.context() as patch:
        patch.setattr(f"gpu.{name}", lose)
        message = stage.refusal()
    assert message.startswith("Error: ") and message.count("\n") == 1
    assert stage.render().at(0.0) == gray(LIT)


def test_interrupted_render_is_a_message(stage: Stage, monkeypatch) -> None:
    stage.square()
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell's jobs in the background ignore it
    try:
        with monkeypatch.context() as patch:
            patch.setattr(renderer.Renderer, "read", lambda _: signal.raise_signal(signal.SIGINT))
            assert "KeyboardInterrupt" in stage.refusal()
    finally:
        signal.signal(signal.SIGINT, before)
    assert stage.render().at(0.0) == gray(LIT)


def test_scene_that_goes_away_while_it_is_rendered(stage: Stage, monkeypatch) -> None:
    """Handlers of other add-ons may do so; what has been sent to the driver is drawn to its end."""
    stage.square()
    real, drawn = renderer.Renderer.add, []

    def add(self: renderer.Renderer, *arguments: object) -> None:
        drawn.append(self)
        if len(drawn) == 2:
            stage.scene.render.engine = engines.CYCLES.identifier
            bpy.data.batch_remove([*bpy.data.meshes, *bpy.data.lights])
        real(self, *arguments)

    stage.scene.true_diffuse.samples = 4
    monkeypatch.setattr(renderer.Renderer, "add", add)
    assert stage.render().at(0.0) == gray(LIT)
    assert len(drawn) == 4


def test_programs_are_used_by_one_thread_at_a_time(stage: Stage, monkeypatch) -> None:
    """Drivers keep the values of uniforms with the program: a render in another thread would draw a viewport's."""
    skin = materials.create("Skin", SUBSURFACE)
    squares = stage.square(), stage.square(0.3)
    squares[1].location.z = 1.0  # what lies in one plane has no shadows
    for square in squares:
        square.data.materials.append(skin)
    free: list[bool] = []

    def ask() -> None:
        free.append(driver.PROGRAM_LOCK.acquire(blocking=False))
        if free[-1]:
            driver.PROGRAM_LOCK.release()

    def asking(real: Callable) -> Callable:
        def called(*arguments: object) -> object:
            other = threading.Thread(target=ask)
            other.start()
            other.join()
            return real(*arguments)

        return called

    # what begins each use of a program: for surfaces and shadows the depth test, then the program itself
    for user, name in (
        (driver_scene, "use_depth_test"),
        (shadow_maps, "use_depth_test"),
        (renderer, "bound"),
        (shadow_maps, "bound"),
    ):
        monkeypatch.setattr(user, name, asking(getattr(driver, name)))
    stage.render()
    assert free == [False] * (2 + 5)  # shadows, surfaces, scattering, the sum, the picture
    assert driver.PROGRAM_LOCK.acquire(blocking=False)
    driver.PROGRAM_LOCK.release()


class Window:
    """What Blender makes of the engine for a window, with what it reports."""

    bl_label = "Realtime"

    def __init__(self, width: int) -> None:
        gpu.init()
        region = SimpleNamespace(width=width, height=HEIGHT, as_pointer=lambda: 0)
        seen = SimpleNamespace(
            view_matrix=Matrix(),
            perspective_matrix=Matrix.Diagonal((0.5, 0.75, -0.01, 1.0)),
            is_perspective=False,
            view_perspective="ORTHO",
        )
        area = next(area for screen in bpy.data.screens for area in screen.areas if area.type == "VIEW_3D")
        self.context = SimpleNamespace(region=region, region_data=seen, space_data=area.spaces.active, area=area)
        self.reports: list[str] = []
        self.stats: tuple[str, str] = "", ""
        self.viewport = viewport.Viewport()
        self.target = gpu.types.GPUTexture((WIDTH, HEIGHT), format="RGBA32F")

    def report(self, kinds: set[str], message: str) -> None:
        self.reports.append(message)

    def update_stats(self, stats: str, info: str) -> None:
        self.stats = stats, info

    def draw(self) -> float:
        """Draw as Blender does and return the middle's red."""
        self.target.clear(format="FLOAT", value=(0.0, 0.0, 0.0, 0.0))
        with gpu.types.GPUFrameBuffer(color_slots=self.target).bind():
            self.redraw()
        return self.target.read().to_list()[HEIGHT // 2][WIDTH // 2][0]

    def redraw(self) -> None:
        self.viewport.draw(self, self.context, bpy.context.evaluated_depsgraph_get())

    def update(self) -> None:
        self.viewport.update(self, self.context, bpy.context.evaluated_depsgraph_get())


@pytest.fixture
def work(monkeypatch) -> dict[str, int]:
    """How many meshes, materials and lights are read, shadow maps and samples drawn, and objects' parts drawn one by one."""
    counts: dict[str, int] = {}

    def counted(name: str, real: Callable) -> Callable:
        def counting(*arguments: object, **named: object) -> object:
            counts[name] = counts.get(name, 0) + 1
            return real(*arguments, **named)

        return counting

    for name, owner, function in (
        ("meshes", scene_cache, "Mesh"),
        ("materials", scene_cache, "render_material"),
        ("lights", scene_cache, "read_light"),
        ("shadows", shadow_maps.ShadowMaps, "_draw"),
        ("samples", renderer.Renderer, "add"),
        ("parts", driver_scene.DriverScene, "draw_part"),
    ):
        monkeypatch.setattr(owner, function, counted(name, getattr(owner, function)))
    return counts


@pytest.fixture
def crowd(stage: Stage) -> Iterator[tuple[Window, list[bpy.types.Object]]]:
    """A window that shows twelve squares of one mesh in three materials, all drawn, and the squares."""
    first = stage.square(0.1, -1.5)
    shown = [materials.create(f"Material {k}", ROUGH_DIFFUSE) for k in range(3)]
    first.data.materials.append(None)
    squares = [first]
    for k in range(1, 12):
        squares.append(stage.link(first.copy()))
        squares[-1].location.x, squares[-1].location.z = 0.25 * k, 0.01 * k  # in one plane none shades another
    for k, item in enumerate(squares):
        item.material_slots[0].link = "OBJECT"
        item.material_slots[0].material = shown[k % 3]
    stage.scene.true_diffuse.viewport_samples = 2
    bpy.data.lights["Light"].angle = 0.0
    for name, scene in (("Hidden", stage.scene), ("Elsewhere", bpy.data.scenes.new("Other"))):
        scene.collection.objects.link(bpy.data.objects.new(name, first.data))
    bpy.data.objects["Hidden"].hide_viewport = True
    materials.create("Unused", ROUGH_DIFFUSE)
    window = Window(WIDTH)

    def read(_: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        window.viewport.update(window, window.context, depsgraph)

    bpy.app.handlers.depsgraph_update_post.append(read)
    stage.scene.update_tag()
    bpy.context.view_layer.update()
    for _ in range(3):
        window.draw()
    yield window, squares
    bpy.app.handlers.depsgraph_update_post.remove(read)


def turned(window: Window) -> None:
    """See a part of all, which the shadow map then fits more tightly."""
    window.context.region_data.perspective_matrix = Matrix.Diagonal((2.0, 3.0, -0.01, 1.0))


# For an edit of the window or the squares: what is read and drawn until the picture has its two samples again
WORK = {
    "nothing": (lambda *_: None, {}),
    "select": (lambda _, squares: squares[3].select_set(True), {}),
    "move the camera that is not looked through": (lambda *_: setattr(bpy.data.objects["Camera"].location, "x", 1.0), {}),
    "move what is hidden": (lambda *_: setattr(bpy.data.objects["Hidden"].location, "x", 0.5), {}),
    "move what another scene shows": (lambda *_: setattr(bpy.data.objects["Elsewhere"].location, "x", 0.5), {}),
    "edit a material that nothing wears": (
        lambda *_: setattr(bpy.data.materials["Unused"].node_tree.nodes["Rough Diffuse"].inputs["Roughness"], "default_value", 0.9),
        {},
    ),
    "move": (lambda _, squares: setattr(squares[3].location, "y", 0.5), {"shadows": 1, "samples": 2, "parts": 3 + 2 * 3}),
    "edit a material": (
        lambda _, squares: setattr(
            squares[3].active_material.node_tree.nodes["Rough Diffuse"].inputs["Roughness"], "default_value", 0.9
        ),
        {"materials": 1, "samples": 2, "parts": 2 * 3},
    ),
    "other light": (lambda *_: setattr(bpy.data.lights["Light"], "energy", 2.0), {"lights": 1, "samples": 2, "parts": 2 * 3}),
    "give a light a size": (  # the first sample sees its center as before
        lambda *_: setattr(bpy.data.lights["Light"], "angle", 0.1),
        {"lights": 1, "shadows": 1, "samples": 2, "parts": 3 + 2 * 3},
    ),
    "turn a light": (
        lambda *_: setattr(bpy.data.objects["Light"].rotation_euler, "x", 0.3),
        {"lights": 1, "shadows": 1, "samples": 2, "parts": 3 + 2 * 3},
    ),
    "turn the view": (lambda window, _: turned(window), {"shadows": 1, "samples": 2, "parts": 3 + 2 * 3}),
    "hide": (lambda _, squares: squares[3].hide_set(True), {"lights": 1, "shadows": 1, "samples": 2, "parts": 3 + 2 * 3}),
}


@pytest.mark.parametrize("name", WORK)
def test_viewport_reads_and_draws_what_changed_alone(
    crowd: tuple[Window, list[bpy.types.Object]], work: dict[str, int], name: str
) -> None:
    """All objects of one mesh and one material are drawn in one call."""
    window, squares = crowd
    before = window.draw()
    edit, expected = WORK[name]
    edit(window, squares)
    bpy.context.view_layer.update()
    for _ in range(4):
        seen = window.draw()
    assert work == expected
    if not expected:
        assert seen == before != 0.0


def test_first_picture_does_not_wait_for_all_meshes(stage: Stage, monkeypatch) -> None:
    """The middle is read last. Blender is asked for redraws until all is there, and the picture has all its samples."""
    asked: list[object] = []
    monkeypatch.setattr(bpy.app.timers, "register", asked.append)
    monkeypatch.setattr(viewport, "FIRST_READING", 1e-9)
    stage.scene.true_diffuse.viewport_samples = 1
    for x in (-1.5, 1.5, 0.0):
        stage.square(0.3, x)
    window = Window(WIDTH)
    window.update()
    shown, said = [], []
    while not shown or asked:
        asked.clear()
        shown.append(window.draw())
        said.append(window.stats[0])
    assert shown == pytest.approx([0.0, 0.0, LIT], rel=2e-6)
    assert said == ["Reading the scene"] * 2 + ["Sample 1/1"]


def test_first_sample_ever_has_a_smaller_shadow_map(stage: Stage, monkeypatch) -> None:
    """Its square has a quarter of the texels; from the second sample on the shadow is that of any picture."""
    sizes: list[int] = []
    real = shadow_maps.ShadowMaps._draw

    def drawn(maps: shadow_maps.ShadowMaps, tiles: list, sample: int) -> None:
        sizes.extend(tile.size for tile in tiles)
        real(maps, tiles, sample)

    monkeypatch.setattr(shadow_maps.ShadowMaps, "_draw", drawn)
    stage.square(2.0)
    stage.square(0.3).location.z = 1.0
    stage.sun.data.angle = 0.0
    stage.scene.true_diffuse.viewport_samples = 3
    window = Window(WIDTH)
    window.update()
    for _ in range(4):
        window.draw()
    assert sizes == [shadows.MAP_SIZE // 2, shadows.MAP_SIZE]
    turned(window)
    for _ in range(4):
        window.draw()
    assert sizes[2:] == [shadows.MAP_SIZE]


@pytest.mark.parametrize("name", ["state.blend_set", "types.GPUUniformBuf", "types.GPUFrameBuffer"])
def test_viewport_says_once_what_failed_and_draws_again_after_an_edit(stage: Stage, monkeypatch, name: str) -> None:
    stage.square()
    window = Window(WIDTH)
    window.update()
    assert window.draw() == pytest.approx(LIT, rel=2e-6)

    def lose(*_: object, **__: object) -> None:
        raise SystemError("no context")

    window.context.region_data.perspective_matrix = Matrix.Diagonal((0.25, 0.4, -0.01, 1.0))
    window.context.region.width = WIDTH + 8
    with monkeypatch.context() as patch:
        patch.setattr(f"gpu.{name}", lose)
        for _ in range(3):
            window.redraw()
    assert window.reports == ["True Diffuse Realtime failed: no context"]
    window.context.region.width = WIDTH
    window.update()
    assert window.draw() == pytest.approx(LIT, rel=2e-6)


def test_viewport_is_updated_without_a_context(stage: Stage, monkeypatch) -> None:
    """Blender may have none then; of what the gpu module makes, these two need one."""
    stage.square()
    window = Window(WIDTH)

    def refuse(*_: object, **__: object) -> None:
        raise RuntimeError("No active GPU context found")

    with monkeypatch.context() as patch:
        for name in ("GPUUniformBuf", "GPUTexture"):
            patch.setattr(gpu.types, name, refuse)
        window.update()
    assert window.draw() == pytest.approx(LIT, rel=2e-6)
    assert window.reports == []


def test_viewport_too_large_for_the_driver_is_drawn_once_it_is_smaller(stage: Stage) -> None:
    stage.square()
    window = Window(WIDTH)
    window.update()
    window.context.region.width = 65536
    assert window.draw() == window.draw() == 0.0
    assert window.reports == [f"The graphics driver has no room for a picture of 65536 x {HEIGHT} pixels"]
    window.context.region.width = WIDTH
    assert window.draw() == pytest.approx(LIT, rel=2e-6)


def lit_pixels(window: Window) -> tuple[int, int, int, int]:
    """Draw; return the lit rectangle's left, bottom, right and top in pixels, and assert that it is lit all over."""
    window.draw()
    rows = window.target.read().to_list()
    lit = {(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if pixel[0] == pytest.approx(LIT, rel=2e-6)}
    dark = {(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if pixel[3] == 0.0}
    left, bottom, right, top = (pick(at[k] for at in lit) for pick, k in ((min, 0), (min, 1), (max, 0), (max, 1)))
    assert len(lit) == (right + 1 - left) * (top + 1 - bottom) and len(lit) + len(dark) == WIDTH * HEIGHT
    return left, bottom, right + 1, top + 1


def test_viewport_draws_inside_its_render_border(stage: Stage) -> None:
    stage.square(9.0)
    window = Window(WIDTH)
    window.update()
    space = window.context.space_data
    assert lit_pixels(window) == (0, 0, WIDTH, HEIGHT)
    space.use_render_border = True
    space.render_border_min_x, space.render_border_max_x = 0.25, 0.5
    space.render_border_min_y, space.render_border_max_y = 0.5, 1.0
    assert lit_pixels(window) == (WIDTH // 4, HEIGHT // 2, WIDTH // 2, HEIGHT)
    stage.scene.render.use_border = True  # which is the camera's
    assert lit_pixels(window) == (WIDTH // 4, HEIGHT // 2, WIDTH // 2, HEIGHT)
    space.use_render_border = False
    assert lit_pixels(window) == (0, 0, WIDTH, HEIGHT)


def test_viewport_through_the_camera_draws_inside_its_border(stage: Stage) -> None:
    """The window shows 4 m across 48 pixels, and 8 / 3 m along 32; the camera's frame in it is 2 m by 1.5 m: 24 by 18 pixels."""
    stage.square(9.0)
    window = Window(WIDTH)
    window.update()
    window.context.region_data.view_perspective = "CAMERA"
    stage.camera.data.ortho_scale = 2.0
    render = stage.scene.render
    render.resolution_x, render.resolution_y = 400, 300
    bpy.context.view_layer.update()
    assert lit_pixels(window) == (0, 0, WIDTH, HEIGHT)
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.75, 0.5, 1.0
    assert lit_pixels(window) == (12 + 6, 7 + 9, 12 + 18, 7 + 18)
    stage.camera.scale.x = -1.0  # as mirrored as what is seen through it
    window.context.region_data.perspective_matrix = Matrix.Diagonal((-0.5, 0.75, -0.01, 1.0))
    bpy.context.view_layer.update()
    assert lit_pixels(window) == (12 + 6, 7 + 9, 12 + 18, 7 + 18)
    stage.camera.location.x = 9.0  # its frame is not in the window
    bpy.context.view_layer.update()
    assert window.draw() == 0.0
    assert window.reports == []


def test_viewport_says_what_is_left_out_and_lists_settings_with_the_last_sample(stage: Stage) -> None:
    """A point cloud is left out of every sample; that a pass is asked for is looked up once there is time."""
    window = Window(WIDTH)
    stage.scene.true_diffuse.viewport_samples = 2
    bpy.context.view_layer.use_pass_mist = True
    stage.square()
    stage.link(bpy.data.objects.new("Points", bpy.data.pointclouds.new("Points")))
    window.update()
    for sample, listed in ((1, 1), (2, 2)):
        window.draw()
        assert window.stats == (f"Sample {sample}/2", "Point clouds are not drawn (1)")
        assert len(not_drawn.messages(stage.scene)) == listed


@pytest.mark.parametrize("kind", ["ORTHO", "PERSP"])
def test_depth_is_the_distance_along_the_cameras_axis(stage: Stage, kind: str) -> None:
    """Of a square that slopes upwards by 1 in 2 from its middle, 5 m away: 5 m - x / 2, at x = 2 (2 column + 1 - width) / width.

    In perspective x is as large times the distance over 5 m, where the camera sees 4 m across. Four roundings of 2^-24 of a depth
    in clip space, with the near plane at 0.1 m, are 4 x 2^-24 x (5.5 m)^2 / 0.2 m = 4e-5 m. Without a surface it is 1e10, as in
    Cycles.
    """
    stage.mesh([(-1, -1, -0.5), (1, -1, 0.5), (1, 1, 0.5), (-1, 1, -0.5)], [(0, 1, 2, 3)])
    stage.camera.data.type = kind
    stage.camera.data.angle = 2.0 * math.atan(2.0 / 5.0)
    bpy.context.view_layer.use_pass_z = True
    channels = render_passes(stage.scene)
    (depth,) = (values for name, values in channels.items() if "Depth" in name)
    row = depth[WIDTH * (HEIGHT // 2) :][:WIDTH]
    for column, found in enumerate(row):
        x = 2.0 * (2 * column + 1 - WIDTH) / WIDTH  # m, on the ground
        expected = 5.0 - x / 2.0 if kind == "ORTHO" else 5.0 / (1.0 + x / 10.0)
        if abs(x if kind == "ORTHO" else x * expected / 5.0) < 1.0:
            assert found == pytest.approx(expected, abs=4e-5)
        else:
            assert found == pytest.approx(1e10)


def test_viewport_leaves_out_the_objects_of_a_hidden_collection(stage: Stage) -> None:
    """Blender keeps them in the depsgraph, unlike objects that are hidden themselves."""
    window = Window(WIDTH)
    hidden = bpy.data.collections.new("Hidden")
    stage.scene.collection.children.link(hidden)
    square = stage.square()
    stage.scene.collection.objects.unlink(square)
    hidden.objects.link(square)
    window.update()
    assert window.draw() == pytest.approx(LIT, rel=2e-6)
    layer = bpy.context.view_layer.layer_collection.children["Hidden"]
    for is_hidden in (True, False):
        layer.hide_viewport = is_hidden
        window.update()
        assert window.draw() == (0.0 if is_hidden else pytest.approx(LIT, rel=2e-6))


def test_viewport_alone_is_drawn_again_unless_it_is_closed(monkeypatch) -> None:
    drawn = []
    regions = [SimpleNamespace(as_pointer=lambda k=k: k, tag_redraw=lambda k=k: drawn.append(k)) for k in range(4)]
    areas = [SimpleNamespace(regions=regions[:2]), SimpleNamespace(regions=regions[2:])]  # each with its header, say
    windows = [SimpleNamespace(screen=SimpleNamespace(areas=areas))]
    context = SimpleNamespace(window_manager=SimpleNamespace(windows=windows))
    monkeypatch.setattr(viewport, "bpy", SimpleNamespace(context=context))
    for address in (2, 5):  # of an open region, and of a closed one
        viewport.redraw(address)
    assert drawn == [2]


# ---- what is wrong with a scene is left out, with a message; the rest is drawn


@pytest.mark.parametrize("number", NUMBERS, ids=str)
def test_vertices_that_are_not_finite(stage: Stage, capfd, number: float) -> None:
    corners = [(-1, -1, 0), (0, -1, 0), (0, 1, 0), (-1, 1, 0), (1, -1, 0), (1, number, 0)]
    stage.mesh(corners, [(0, 1, 2, 3), (1, 4, 5)])
    seen = stage.render()
    assert seen.at(-0.5) == gray(LIT) and seen.at(0.3, -0.5) == gray(0.0)
    assert warnings(capfd) == ["Mesh: 1 triangles are left out, as their vertices are not finite or too far away"]


@pytest.mark.parametrize("count", [1, 200])
def test_mesh_without_finite_vertices(stage: Stage, count: int) -> None:
    stage.square()
    stage.mesh([(math.nan,) * 3] * 3 * count, [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(count)])
    assert stage.render().at(0.0) == gray(LIT)


@pytest.mark.parametrize("number", NUMBERS, ids=str)
@pytest.mark.parametrize("setting", ["location", "scale"])
def test_objects_whose_location_or_scale_is_not_finite(stage: Stage, capfd, setting: str, number: float) -> None:
    stage.square()
    setattr(stage.square(), setting, (number, 1.0, 1.0))
    setattr(stage.light(5.0, "SPOT"), setting, (number, 1.0, 1.0))
    assert stage.render().at(0.0) == gray(LIT)
    assert {line.partition(": left out")[0] for line in warnings(capfd)} == {"Mesh.001", "Light.001"}


@pytest.mark.parametrize("number", NUMBERS, ids=str)
def test_power_that_is_not_finite(stage: Stage, capfd, number: float) -> None:
    stage.square()
    stage.light(number)
    stage.scene.world = bpy.data.worlds.new("World")
    stage.scene.world.node_tree.nodes["Background"].inputs["Strength"].default_value = number
    assert stage.render().at(0.0) == gray(LIT)
    assert {line.partition(", as")[0] for line in warnings(capfd)} == {"Light.001: left out", "World: the world is black"}


def test_empty_meshes(stage: Stage) -> None:
    stage.square()
    stage.mesh([], [])
    stage.mesh([(0, 0, 1)], [])
    stage.mesh([(0, 0, 1), (1, 0, 1)], [], ((0, 1),))
    text = bpy.data.curves.new("Text", "FONT")
    text.body = ""
    stage.link(bpy.data.objects.new("Text", text))
    stage.link(bpy.data.objects.new("Curve", bpy.data.curves.new("Curve", "CURVE")))
    stage.link(bpy.data.objects.new("Hair", bpy.data.hair_curves.new("Hair")))
    stage.link(bpy.data.objects.new("Nothing", None))
    seen = stage.render()
    assert seen.at(0.0) == gray(LIT) and seen.at(1.5) == gray(0.0)


def test_objects_of_other_kinds_are_left_out_by_name(stage: Stage, capfd) -> None:
    stage.square()
    for name, data in (
        ("Points", bpy.data.pointclouds.new("Points")),
        ("Smoke", bpy.data.volumes.new("Smoke")),
    ):
        stage.link(bpy.data.objects.new(name, data))
    assert stage.render().at(0.0) == gray(LIT)
    assert set(warnings(capfd)) == {
        "Points: point clouds are not drawn",
        "Smoke: volumes are not drawn",
    }


def test_empty_scene(stage: Stage) -> None:
    assert set(stage.render().pixels) == {0.0, 1.0}


@pytest.mark.parametrize("scale", [(-1, 1, 1), (-1, -1, -1), (1, 1, 0), (1e10, 1e10, 1e10)])
def test_normals_of_scaled_objects(stage: Stage, scale: tuple[float, float, float]) -> None:
    """A square lies flat whatever its scale: LIT times the cosine of the sun's tilt."""
    stage.sun.rotation_euler.x = 0.8
    item = stage.square(1.0 / abs(scale[0]))
    item.scale = scale
    assert stage.render().at(0.3, 0.2) == gray(LIT * math.cos(0.8))


def test_shadows_of_nothing(stage: Stage) -> None:
    """A sun while what is there neither casts one nor is in the picture, and a spot in the place of all that casts."""
    item = stage.square(0.5, 9.0)
    item.visible_shadow = False
    assert stage.render().at(0.0) == gray(0.0)
    item.visible_shadow, item.scale = True, (0.0, 0.0, 0.0)
    stage.light(1.0, "SPOT")
    assert stage.render().at(0.0) == gray(0.0)


def test_object_without_size_is_not_seen(stage: Stage) -> None:
    stage.square()
    above = stage.square()
    above.location.z, above.scale = 1.0, (0.0, 0.0, 0.0)
    assert stage.render().at(0.0) == gray(LIT)


@pytest.mark.parametrize(("index", "slot"), [(0, 0), (1, 1), (7, 1), (1000000, 1), (-3, 0)])
def test_faces_of_missing_slots(stage: Stage, index: int, slot: int) -> None:
    """As in Cycles: the last material's, below 0 the first's."""
    item = stage.square()
    colors = ((0.1, 0.2, 0.3), (0.4, 0.5, 0.6))
    for color in colors:
        material, node = materials.create_plain("Plain")
        node.inputs["Color"].default_value = (*color, 1.0)
        item.data.materials.append(material)
    item.data.attributes.new("material_index", "INT", "FACE").data[0].value = index
    assert stage.render().at(0.0)[:3] == pytest.approx([value / math.pi for value in colors[slot]], rel=2e-6)


def without_nodes(tree: bpy.types.NodeTree) -> None:
    pass


def without_closure(tree: bpy.types.NodeTree) -> None:
    tree.nodes.new("ShaderNodeOutputMaterial")


def with_unlinked_group(tree: bpy.types.NodeTree) -> None:
    without_closure(tree)
    tree.nodes.new("ShaderNodeGroup")


def with_empty_group(tree: bpy.types.NodeTree) -> None:
    output, group = tree.nodes.new("ShaderNodeOutputMaterial"), tree.nodes.new("ShaderNodeGroup")
    group.node_tree = bpy.data.node_groups.new("Empty", "ShaderNodeTree")
    group.node_tree.interface.new_socket("Shader", in_out="OUTPUT", socket_type="NodeSocketShader")
    tree.links.new(group.outputs[0], output.inputs["Surface"])


@pytest.mark.parametrize("build", [without_nodes, without_closure, with_unlinked_group, with_empty_group])
def test_material_without_a_closure_is_black(stage: Stage, build: Callable[[bpy.types.NodeTree], None]) -> None:
    material = bpy.data.materials.new("Unreadable")
    stage.square().data.materials.append(material)
    material.node_tree.nodes.clear()
    build(material.node_tree)
    assert stage.render().at(0.0) == gray(0.0)


def test_empty_material_slot_is_gray(stage: Stage) -> None:
    stage.square().data.materials.append(None)
    assert stage.render().at(0.0) == gray(LIT)


@pytest.fixture
def image_node(stage: Stage) -> bpy.types.Node:
    """Return the image node of the material of a square on the left; one on the right has no material."""
    left = stage.square(0.5, -1.0)
    stage.square(0.5, 1.0)
    left.data.uv_layers.new()
    material, node = materials.create_plain("Painted")
    left.data.materials.append(material)
    texture = material.node_tree.nodes.new("ShaderNodeTexImage")
    material.node_tree.links.new(texture.outputs["Color"], node.inputs["Color"])
    return texture


def white_image(width: int) -> bpy.types.Image:
    image = bpy.data.images.new("White", width, 4, float_buffer=width < 10)
    image.generated_color = (1.0, 1.0, 1.0, 1.0)
    return image


def painted(image: bpy.types.Image, *color: float) -> None:
    image.pixels.foreach_set([*color, 1.0] * (image.size[0] * image.size[1]))


def scaled(image: bpy.types.Image) -> None:
    image.scale(8, 8)
    painted(image, 0.0, 0.0, 1.0)


def generated(image: bpy.types.Image) -> None:
    image.source, image.generated_type = "GENERATED", "BLANK"
    image.generated_color = (0.0, 0.0, 1.0, 1.0)


def from_file(image: bpy.types.Image) -> None:
    image.filepath = image.filepath.replace("first", "second")


def reloaded(image: bpy.types.Image) -> None:
    Path(image.filepath).write_bytes(Path(image.filepath.replace("first", "second")).read_bytes())
    image.reload()


def packed(image: bpy.types.Image) -> None:
    from_file(image)
    image.pack()


@pytest.mark.parametrize(
    "edit",
    [lambda image: painted(image, 0.0, 0.0, 1.0), scaled, generated, from_file, reloaded, packed],
    ids=lambda edit: edit.__name__,
)
def test_viewport_shows_the_image_that_a_script_has_changed(
    stage: Stage, image_node: bpy.types.Node, edit: Callable[[bpy.types.Image], None]
) -> None:
    """Red becomes blue, with a picture that had all its samples."""
    for name, color in (("first", (1.0, 0.0, 0.0)), ("second", (0.0, 0.0, 1.0))):
        image = bpy.data.images.new(name, 4, 4)
        painted(image, *color)
        image.filepath_raw, image.file_format = str(stage.folder / f"{name}.png"), "PNG"
        image.save()
    image_node.image = bpy.data.images.load(str(stage.folder / "first.png"))
    stage.scene.true_diffuse.viewport_samples = 2
    window = Window(WIDTH)
    window.context.region_data.perspective_matrix = Matrix.Translation((0.5, 0.0, 0.0)) @ Matrix.Diagonal((0.5, 0.75, -0.01, 1.0))

    def read(_: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        window.viewport.update(window, window.context, depsgraph)

    def seen() -> list[float]:
        bpy.context.view_layer.update()
        for _ in range(4):
            window.draw()
        return window.target.read().to_list()[HEIGHT // 2][WIDTH // 2][:3]

    bpy.app.handlers.depsgraph_update_post.append(read)
    try:
        stage.scene.update_tag()
        assert seen() == pytest.approx((1.0 / math.pi, 0.0, 0.0), rel=2e-6)
        edit(image_node.image)
        image_node.image.update()
        assert seen() == pytest.approx((0.0, 0.0, 1.0 / math.pi), rel=2e-6)
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(read)


def test_missing_image_is_pink_with_a_message(stage: Stage, image_node: bpy.types.Node, capfd) -> None:
    image_node.image = bpy.data.images.new("Missing", 4, 4)
    image_node.image.source, image_node.image.filepath = "FILE", "/nowhere/missing.png"
    seen = stage.render()
    assert seen.at(-1.0) == pink() and seen.at(1.0) == gray(LIT)
    assert warnings(capfd) == ["Missing: the image cannot be read"]


@pytest.mark.parametrize("width", [4, 20, None], ids=["floats", "bytes", "wider than a texture may be"])
def test_image_of_any_width_is_drawn(stage: Stage, image_node: bpy.types.Node, capfd, width: int | None) -> None:
    """Blender makes an image smaller that is wider than a texture may be."""
    if width is None:
        gpu.init()
        width = gpu.capabilities.max_texture_size_get() + 8
    image_node.image = white_image(width)
    seen = stage.render()
    assert seen.at(-1.0) == gray(1.0 / math.pi) and seen.at(1.0) == gray(LIT)
    assert warnings(capfd) == []


def test_image_that_the_driver_refuses_is_pink(stage: Stage, image_node: bpy.types.Node, capfd, monkeypatch) -> None:
    image_node.image = white_image(4)

    def refuse(_: bpy.types.Image) -> None:
        raise RuntimeError("no room")

    monkeypatch.setattr(gpu.texture, "from_image", refuse)
    seen = stage.render()
    assert seen.at(-1.0) == pink() and seen.at(1.0) == gray(LIT)
    assert warnings(capfd) == ["White: the graphics driver has no room for the image, which is not drawn"]


# ---- large numbers


def test_without_lights_only_the_world_shines(stage: Stage) -> None:
    """A face that sees radiance L from everywhere reflects 0.8 L; without a world it is black."""
    stage.square()
    bpy.data.objects.remove(stage.sun)
    assert stage.render().at(0.0) == gray(0.0)
    stage.scene.world = bpy.data.worlds.new("World")
    stage.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    seen = stage.render()
    assert seen.at(0.0) == gray(0.4) and seen.at(1.5) == gray(0.5)


@pytest.mark.parametrize("count", [64, 65])
def test_many_lights(stage: Stage, capfd, count: int) -> None:
    """Each with a shadow map of its own. A sum of 64 numbers of 32 bits: within 64 halves of a last place."""
    stage.square()
    stage.sun.data.energy = 1.0 / 64.0
    for _ in range(count - 1):
        stage.light(1.0 / 64.0)
    assert stage.render().at(0.0)[:3] == pytest.approx([LIT] * 3, rel=5e-6)
    assert warnings(capfd) == ([f"Light.{64:03}: left out, as 64 lights are drawn"] if count == 65 else [])


def test_a_million_triangles(stage: Stage) -> None:
    """A million on a plane are as bright as two."""
    stage.sun.rotation_euler = (0.3, 0.2, 0.0)
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=708, y_subdivisions=708, size=2.0)
    assert 2 * len(bpy.context.object.data.polygons) > 1_000_000
    seen = stage.render()
    brightness = LIT * math.cos(0.3) * math.cos(0.2)
    # normals of faces so small are as exact as their vertices, whose steps are 2.8 mm and whose rounding is 6e-8 m: 2e-5 of it
    assert seen.at(0.0)[:3] == pytest.approx([brightness] * 3, rel=2e-4) and seen.at(1.5) == gray(0.0)
    inside = [value for x, value in enumerate(seen.row()) if abs((x + 0.5) * 4.0 / WIDTH - 2.0) < 0.95]
    assert min(inside) == pytest.approx(max(inside), rel=2e-4)


# ---- what Blender's settings ask for


def test_part_of_the_picture(stage: Stage) -> None:
    stage.square()
    whole = stage.render()
    render = stage.scene.render
    render.use_border = True
    render.border_min_x, render.border_max_x, render.border_min_y, render.border_max_y = 0.25, 0.5, 0.5, 1.0
    part = stage.render()
    assert (part.width, part.height) == (WIDTH, HEIGHT)
    for y in range(HEIGHT):
        for x in range(WIDTH):
            at = 4 * (y * WIDTH + x)
            inside = 12 <= x < 24 and y >= 16
            assert part.pixels[at : at + 4] == (whole.pixels[at : at + 4] if inside else (0.0, 0.0, 0.0, 0.0))
    render.use_crop_to_border = True
    cropped = stage.render()
    assert (cropped.width, cropped.height) == (12, 16)
    rows = [part.pixels[4 * (y * WIDTH + 12) :][:48] for y in range(16, 32)]
    assert cropped.pixels == tuple(value for row in rows for value in row)


@pytest.mark.parametrize("percentage", [1, 29, 33, 58, 100])
def test_percentage_of_the_resolution(stage: Stage, percentage: int) -> None:
    """In whole numbers, as 29 % of 100 are less than 29 in binary fractions; Blender checks the size of what it gets."""
    stage.square()
    stage.scene.render.resolution_x = stage.scene.render.resolution_y = 400
    stage.scene.render.resolution_percentage = percentage
    seen = stage.render()
    assert (seen.width, seen.height) == (4 * percentage, 4 * percentage)
    middle = 4 * (seen.width * (seen.height // 2) + seen.width // 2)
    assert seen.pixels[middle : middle + 4] == gray(LIT)


def cropped_width(stage: Stage, width: int, low: float, high: float) -> int:
    """Return the width of a picture that is cropped to a border [pixels]."""
    stage.square()
    render = stage.scene.render
    render.resolution_x, render.resolution_y, render.use_border, render.use_crop_to_border = width, 20, True, True
    render.border_min_x, render.border_max_x = low, high
    return stage.render().width


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.7), (0.3, 1.0), (0.333, 0.777), (0.1, 0.9)])
@pytest.mark.parametrize("width", [10, 47, 1001])
def test_borders_between_pixels(stage: Stage, width: int, low: float, high: float) -> None:
    """Blender rejects a picture that has another size than it expects."""
    assert abs(cropped_width(stage, width, low, high) - (high - low) * width) <= 1.0


def test_borders_are_rounded_as_blender_does(stage: Stage) -> None:
    """In 32 bits 0.7 of 10 pixels are 7."""
    assert cropped_width(stage, 10, 0.0, 0.7) == 7


def test_pixels_that_are_not_square(stage: Stage) -> None:
    """Twice as wide as high: the picture shows 4 m across its width still, of the height half as much."""
    stage.square(0.5)
    stage.scene.render.pixel_aspect_x = 2.0
    seen = stage.render()
    assert sum(value > 0.0 for value in seen.row()) == WIDTH // 4
    column = seen.pixels[4 * (WIDTH // 2) :: 4 * WIDTH]
    assert sum(value > 0.0 for value in column) == 2 * WIDTH // 4


def test_perspective(stage: Stage) -> None:
    """A lens of 50 mm before 36 mm sees 3.6 m at 5 m: a square of 1.8 m covers half of the width."""
    stage.square(0.9)
    stage.camera.data.type = "PERSP"
    row = stage.render().row()
    assert [value > 0.0 for value in row] == [12 <= x < 36 for x in range(WIDTH)]


def test_view_layers(stage: Stage) -> None:
    """Each has its own objects and its own picture."""
    hidden = bpy.data.collections.new("Hidden")
    stage.scene.collection.children.link(hidden)
    item = stage.square()
    hidden.objects.link(item)
    stage.scene.collection.objects.unlink(item)
    second = stage.scene.view_layers.new("Second")
    second.layer_collection.children["Hidden"].exclude = True
    settings = stage.scene.render.image_settings
    settings.media_type = "MULTI_LAYER_IMAGE"
    path = stage.folder / "picture.exr"
    bpy.ops.render.render(write_still=True)
    read = subprocess.run([sys.executable, "-c", LAYERS, path], capture_output=True, text=True, check=True)
    middles = [tuple(map(float, line.split())) for line in read.stdout.splitlines()]
    assert middles == [gray(LIT), gray(0.0)]


def object_holds_out(item: bpy.types.Object) -> None:
    item.is_holdout = True


def collection_holds_out(item: bpy.types.Object) -> None:
    collection = bpy.data.collections.new("Held out")
    bpy.context.scene.collection.children.link(collection)
    collection.objects.link(item)
    bpy.context.scene.collection.objects.unlink(item)
    bpy.context.view_layer.layer_collection.children["Held out"].holdout = True


def instancer_holds_out(item: bpy.types.Object) -> None:
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(item)
    bpy.context.scene.collection.objects.unlink(item)
    empty = bpy.data.objects.new("Instance", None)
    empty.instance_type, empty.instance_collection, empty.is_holdout = "COLLECTION", collection, True
    bpy.context.scene.collection.objects.link(empty)


@pytest.mark.parametrize(
    "hold_out", [object_holds_out, collection_holds_out, instancer_holds_out], ids=lambda function: function.__name__
)
@pytest.mark.parametrize("is_transparent", [False, True], ids=["opaque film", "transparent film"])
def test_holdout_is_a_hole_as_in_cycles(stage: Stage, hold_out: Callable[[bpy.types.Object], None], is_transparent: bool) -> None:
    """Black without alpha, whatever is behind it; its shadow falls on others."""
    stage.scene.render.film_transparent = is_transparent
    stage.scene.world = bpy.data.worlds.new("World")
    stage.scene.world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    item = stage.square(0.5)
    item.data.materials.append(materials.create("Skin", SUBSURFACE, Specular=0.5))
    hold_out(item)
    beside = 1.5  # nothing is there
    seen = stage.render()
    assert seen.at(0.0) == (0.0, 0.0, 0.0, 0.0)
    assert seen.at(beside) == ((0.0, 0.0, 0.0, 0.0) if is_transparent else gray(0.5))
    stage.scene.render.engine = engines.CYCLES.identifier
    engines.use(stage.scene, engines.CYCLES, 1)
    cycles = stage.render()
    assert [cycles.at(x) for x in (0.0, beside)] == [seen.at(x) for x in (0.0, beside)]


def test_object_of_an_indirect_only_collection_casts_its_shadow_alone(stage: Stage) -> None:
    stage.square()
    collection = bpy.data.collections.new("Above")
    stage.scene.collection.children.link(collection)
    above = stage.square(0.5)
    above.location.z = 1.0
    collection.objects.link(above)
    stage.scene.collection.objects.unlink(above)
    bpy.context.view_layer.layer_collection.children["Above"].indirect_only = True
    seen = stage.render()
    assert seen.at(0.0) == gray(0.0) and seen.at(0.75) == gray(LIT)


def test_view_layer_overrides(stage: Stage, monkeypatch) -> None:
    """A view layer's material, world and samples go before the scene's."""
    item = stage.square()
    bpy.data.objects.remove(stage.sun)
    item.data.materials.append(materials.create_plain("Own")[0])
    layer, other = bpy.context.view_layer, materials.create_plain("Other")
    other[1].inputs["Color"].default_value = (0.25, 0.25, 0.25, 1.0)
    layer.material_override, layer.world_override, layer.samples = other[0], bpy.data.worlds.new("Other"), 3
    layer.world_override.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    real, drawn = renderer.Renderer.add, []
    monkeypatch.setattr(renderer.Renderer, "add", lambda *arguments: drawn.append(1) or real(*arguments))
    seen = stage.render()
    assert seen.at(0.0) == gray(0.125) and seen.at(1.5) == gray(0.5) and len(drawn) == 3


def test_stereoscopic_views(stage: Stage) -> None:
    """Eyes e apart whose frames meet at the distance c see what is at z apart by f e (1/c - 1/z) of the sensor."""
    stage.square(0.5)
    stage.camera.data.type = "PERSP"
    stereo = stage.camera.data.stereo
    stereo.interocular_distance, stereo.convergence_distance, stereo.convergence_mode = 0.4, 2.5, "OFFAXIS"
    stage.scene.render.use_multiview = True
    stage.scene.render.resolution_x = 480
    bpy.ops.render.render(write_still=True)
    starts = []
    for side in "LR":
        row = Picture(stage.folder / f"picture_{side}.exr").row()
        starts.append(next(x for x, value in enumerate(row) if value > 0.0))
        assert sum(value > 0.0 for value in row) in (133, 134)  # 1 m of 3.6 m
    apart = 50.0 * 0.4 * (1.0 / 2.5 - 1.0 / 5.0) / 36.0 * 480.0
    assert starts[1] - starts[0] == pytest.approx(apart, abs=1.0)


def test_animation(stage: Stage) -> None:
    """What is keyed is read at each frame: lamps, sockets and places."""
    item = stage.square()
    material, node = materials.create_plain("Plain")
    item.data.materials.append(material)
    for frame, value in ((1, 0.2), (3, 0.6)):
        node.inputs["Color"].default_value = (value, value, value, 1.0)
        node.inputs["Color"].keyframe_insert("default_value", frame=frame)
        stage.sun.data.energy = value
        stage.sun.data.keyframe_insert("energy", frame=frame)
    for curves in (material.node_tree, stage.sun.data):
        for strip in curves.animation_data.action.layers[0].strips:
            for curve in strip.channelbags[0].fcurves:
                for point in curve.keyframe_points:
                    point.interpolation = "LINEAR"
    stage.scene.frame_end = 3
    stage.scene.render.filepath = str(stage.folder / "frame_")
    bpy.ops.render.render(animation=True)
    seen = [Picture(stage.folder / f"frame_{k:04d}.exr").at(0.0)[0] for k in (1, 2, 3)]
    assert seen == pytest.approx([value * value / math.pi for value in (0.2, 0.4, 0.6)], rel=1e-5)


def test_instances(stage: Stage) -> None:
    """Of a collection, of an object's faces, and of geometry nodes: each where it is, of one mesh on the driver."""
    item = stage.square(0.1)
    collection = bpy.data.collections.new("Instanced")
    collection.objects.link(item)
    stage.scene.collection.objects.unlink(item)
    for x in (-1.5, -1.0):
        empty = stage.link(bpy.data.objects.new("Instance", None))
        empty.instance_type, empty.instance_collection, empty.location.x = "COLLECTION", collection, x
    faces = stage.mesh(
        [(x + dx, dy, 0.0) for x in (0.0, 0.5) for dx, dy in ((0, -0.1), (0.2, -0.1), (0.2, 0.1), (0, 0.1))],
        [(0, 1, 2, 3), (4, 5, 6, 7)],
    )
    child = stage.square(0.1)
    child.parent, faces.instance_type, faces.show_instancer_for_render = faces, "FACES", False
    tree = bpy.data.node_groups.new("Points", "GeometryNodeTree")
    for direction in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=direction, socket_type="NodeSocketGeometry")
    start, end, on_points, info = (
        tree.nodes.new(name)
        for name in ("NodeGroupInput", "NodeGroupOutput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo")
    )
    info.inputs["Object"].default_value = item
    tree.links.new(start.outputs[0], on_points.inputs["Points"])
    tree.links.new(info.outputs["Geometry"], on_points.inputs["Instance"])
    tree.links.new(on_points.outputs[0], end.inputs[0])
    stage.mesh([(1.2, 0.0, 0.0), (1.7, 0.0, 0.0)], []).modifiers.new("Points", "NODES").node_group = tree
    seen = stage.render()
    lit = {x: seen.at(x) == gray(LIT) for x in (-1.75, -1.5, -1.25, -1.0, -0.5, 0.1, 0.35, 0.6, 0.9, 1.2, 1.45, 1.7, 1.9)}
    assert {x for x, is_lit in lit.items() if is_lit} == {-1.5, -1.0, 0.1, 0.6, 1.2, 1.7}


def test_curves_texts_and_metaballs(stage: Stage) -> None:
    curve = bpy.data.curves.new("Curve", "CURVE")
    curve.dimensions, curve.fill_mode = "2D", "BOTH"
    spline = curve.splines.new("POLY")
    spline.points.add(3)
    for point, (x, y) in zip(spline.points, ((-0.4, -0.4), (0.4, -0.4), (0.4, 0.4), (-0.4, 0.4)), strict=True):
        point.co = (x, y, 0.0, 1.0)
    spline.use_cyclic_u = True
    stage.link(bpy.data.objects.new("Curve", curve))
    for k in range(2):  # a family: the first has the mesh of both
        ball = bpy.data.metaballs.new("Ball")
        ball.elements.new().radius = 0.5
        stage.link(bpy.data.objects.new(f"Ball.{k:03d}" if k else "Ball", ball)).location.x = 1.5
    text = bpy.data.curves.new("Text", "FONT")
    text.body, text.size, text.align_x, text.align_y = "\u2588", 1.0, "CENTER", "CENTER"
    stage.link(bpy.data.objects.new("Text", text)).location.x = -1.4
    seen = stage.render()
    assert seen.at(0.0) == gray(LIT) and seen.at(0.6) == gray(0.0)
    assert seen.at(1.5)[0] == pytest.approx(LIT, rel=0.01)  # on top of it
    assert any(value > 0.0 for value in seen.row()[: WIDTH // 4])


@pytest.mark.parametrize(
    ("settings", "radiance"),
    [
        ({"hide_render": True}, LIT),
        ({"visible_camera": False}, 0.0),
        ({"visible_camera": False, "visible_shadow": False}, LIT),
    ],
    ids=["in renders: not there", "from the camera: casts a shadow", "and in shadows: casts none"],
)
def test_hidden_object(stage: Stage, settings: dict[str, bool], radiance: float) -> None:
    stage.square()
    above = stage.square()
    above.location.z = 1.0
    for name, value in settings.items():
        setattr(above, name, value)
    assert stage.render().at(0.0) == gray(radiance)


def test_mesh_that_is_edited(stage: Stage) -> None:
    bpy.ops.mesh.primitive_plane_add(size=1.0)
    bpy.ops.object.mode_set(mode="EDIT")
    mesh = bmesh.from_edit_mesh(bpy.context.object.data)
    bmesh.ops.translate(mesh, verts=mesh.verts, vec=(1.0, 0.0, 0.0))
    bmesh.update_edit_mesh(bpy.context.object.data)
    seen = stage.render()
    bpy.ops.object.mode_set(mode="OBJECT")
    assert seen.at(1.0) == gray(LIT) and seen.at(0.0) == gray(0.0)


# ---- nothing is left behind


def resident() -> int:
    """Return the bytes that this process has in memory; a driver in software keeps there what others keep on the device."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")


def alive() -> dict[str, int]:
    gc.collect()
    kinds = (meshes.Mesh, renderer.Renderer, renderer.RenderTargets, scene_cache.SceneCache)
    return {kind.__name__: sum(isinstance(item, kind) for item in gc.get_objects()) for kind in kinds}


needs_proc = pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="the system does not say what a process has")


@needs_proc
def test_a_hundred_renders_leave_nothing_behind(stage: Stage) -> None:
    """Files, objects and memory are as after the first ten.

    A picture of 128 x 128 pixels takes 128^2 (4 x 16 + 4 + 3 x 16) bytes = 1.9 MB, its mesh 2.7 MB, its shadow map 2.1 MB: were
    any of them kept, a hundred would be 190 MB at least. A tenth of that is left to whatever else allocates.
    """
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=150, y_subdivisions=150, size=3.0)
    item = bpy.context.object
    item.data.materials.append(materials.create("Skin", SUBSURFACE))
    stage.scene.render.resolution_x = stage.scene.render.resolution_y = 128

    def render(times: int) -> tuple[int, dict[str, int], int]:
        for _ in range(times):
            bpy.ops.render.render()
        return len(list(Path("/proc/self/fd").iterdir())), alive(), resident()

    files, objects, memory = render(10)
    files_after, objects_after, memory_after = render(100)
    assert files_after == files
    assert objects_after == objects == dict.fromkeys(objects, 0)
    assert memory_after - memory < 19e6


@needs_proc
def test_a_hundred_edits_leave_nothing_behind(stage: Stage) -> None:
    """As for a viewport while mesh, material and size of the window change: a mesh has 0.6 MB, all have 60 MB, and 6 are left."""
    bpy.ops.mesh.primitive_grid_add(x_subdivisions=70, y_subdivisions=70, size=3.0)
    item = bpy.context.object
    material = materials.create("Rough", ROUGH_DIFFUSE)
    group = next(node for node in material.node_tree.nodes if node.type == "GROUP")
    item.data.materials.append(material)
    gpu.init()
    cache = scene_cache.SceneCache()
    drawer = renderer.Renderer(cache)

    def read(_: bpy.types.Scene, depsgraph: bpy.types.Depsgraph) -> None:
        cache.update(depsgraph)
        drawer.refresh()

    def edit(times: int) -> tuple[int, dict[str, int], int]:
        for k in range(times):
            item.data.vertices[0].co.z = 0.001 * k
            item.data.update()
            group.inputs["Roughness"].default_value = 0.01 * (k % 100)
            stage.camera.data.ortho_scale = 4.0 + 0.01 * k
            bpy.context.view_layer.update()
            view = seen_by(stage.camera, 64 + 4 * (k % 17))
            drawer.begin(view)
            drawer.add(view, 0, 1.5, (0.0, 0.0, 0.0, 1.0))
        return len(list(Path("/proc/self/fd").iterdir())), alive(), resident()

    bpy.app.handlers.depsgraph_update_post.append(read)
    try:
        files, objects, memory = edit(10)
        files_after, objects_after, memory_after = edit(100)
    finally:
        bpy.app.handlers.depsgraph_update_post.remove(read)
    assert files_after == files
    assert objects_after == objects == {"Mesh": 1, "Renderer": 1, "RenderTargets": 1, "SceneCache": 1}
    assert memory_after - memory < 6e6


def seen_by(camera: bpy.types.Object, size: int) -> "view.View":
    depsgraph = bpy.context.evaluated_depsgraph_get()
    projection = camera.evaluated_get(depsgraph).calc_matrix_camera(depsgraph, x=size, y=size)
    direction = camera.matrix_world.to_3x3().col[2]
    return view.View(projection @ camera.matrix_world.inverted(), direction, False, size, size)
