# SPDX-License-Identifier: GPL-3.0-or-later
"""The viewer that compare.py --web writes, in a browser: what it draws, its controls, and the error that it measures."""

import json
import math
import re
from array import array
from base64 import b64encode
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy

import pytest
from mathutils import Matrix, Vector
from mathutils.bvhtree import BVHTree
from mathutils.interpolate import poly_3d_calc

from true_diffuse.addon.models import MODELS as REGISTERED
from true_diffuse.addon.models import Eon, Lambert, Model, OrenNayar, Specular, vector
from true_diffuse.scenes import five_characters
from true_diffuse.scenes.subject import ALBEDO_ATTRIBUTE
from true_diffuse.scripts.characters import character
from true_diffuse.scripts.viewer import page as viewer
from true_diffuse.scripts.web.browser import Browser, Page

pytestmark = pytest.mark.web

ALBEDO = 0.8
MODELS = Specular(), Lambert(), OrenNayar(0.0), OrenNayar(0.2), OrenNayar(0.33)
SIZE = WIDTH, HEIGHT = 60, 100  # pixels of what is read back
PIXELS = """([look, drawn, width, height]) => {
  const bytes = new Uint8Array(viewer.pixels(look, drawn, width, height).buffer)
  let text = ""
  for (let k = 0; k < bytes.length; k += 4096) text += String.fromCharCode(...bytes.subarray(k, k + 4096))
  return btoa(text)
}"""
# The fraction of a picture's pixels that are not as its first one.
DRAWN = """async text => {
  const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0))
  const image = await createImageBitmap(new Blob([bytes], { type: "image/png" }))
  const canvas = new OffscreenCanvas(image.width, image.height).getContext("2d")
  canvas.drawImage(image, 0, 0)
  const colors = new Uint32Array(canvas.getImageData(0, 0, image.width, image.height).data.buffer)
  return colors.filter(color => color !== colors[0]).length / colors.length
}"""


@pytest.fixture(scope="module")
def stage() -> five_characters.FiveCharacters:
    bpy.ops.wm.read_factory_settings(use_empty=True)
    return five_characters.build(character.load("human"), ALBEDO, True, (1280, 480))


@pytest.fixture(scope="module")
def file(stage: five_characters.FiveCharacters, tmp_path_factory: pytest.TempPathFactory) -> Path:
    text, notes = viewer.html(stage, "human", ALBEDO)
    assert not notes
    path = tmp_path_factory.mktemp("viewer") / "viewer.html"
    path.write_text(text)
    return path


@pytest.fixture
def page(browser: Browser, file: Path) -> Iterator[Page]:
    with browser.page({}, (640, 480)) as page:
        opened(page, file)
        yield page


@pytest.fixture
def phone(browser: Browser, file: Path) -> Iterator[Page]:
    with browser.page({}, (390, 844), touch=True) as page:
        opened(page, file)
        yield page


def opened(page: Page, file: Path) -> None:
    page.open(file.as_uri())
    settled(page)


def settled(page: Page) -> None:
    """Wait until what is asked for is drawn and measured."""
    page.itself.locator("#stage[aria-busy=false]").wait_for()


def pixels(page: Page, look: int, drawn: str, size: tuple[int, int] = SIZE) -> array[float]:
    return page.floats(PIXELS, [look, drawn, *size])


def light(page: Page) -> vector.Vector:
    """The direction to the light in the axes of what is read back, by the sliders, which say where it stands around a character."""
    names = ["azimuth", "elevation", "yaw", "pitch"]
    azimuth, elevation, yaw, pitch = map(math.radians, page.call("names => names.map(name => viewer.state[name])", names))
    towards = Vector((math.sin(azimuth) * math.cos(elevation), math.sin(elevation), math.cos(azimuth) * math.cos(elevation)))
    turned = Matrix.Rotation(pitch, 3, "X") @ Matrix.Rotation(yaw, 3, "Y") @ towards
    return vector.normalize(tuple(turned))


def expected(
    page: Page, look: int, model: Model, color: Callable[[float], float] = lambda rho: rho, size: tuple[int, int] = SIZE
) -> array[float]:
    """The radiance of a model for E0 = 1 in all pixels of a look, by its normals, views and the colors of its albedos."""
    normal, view, albedo = (pixels(page, look, name, size) for name in ("normal", "view", "albedo"))
    l, result = light(page), array("f", bytes(4 * len(normal)))
    for k in range(0, len(normal), 4):
        if normal[k + 3]:
            n, v = (vector.normalize(tuple(each[k : k + 3])) for each in (normal, view))
            for channel in range(3):
                result[k + channel] = model.radiance(n, l, v, color(albedo[k + channel]))
    return result


def rms(values: array[float], reference: array[float]) -> float:
    places = [k for k in range(len(reference)) if k % 4 < 3 and reference[k]]
    assert len(places) > 1000
    return math.sqrt(sum((values[k] - reference[k]) ** 2 for k in places) / sum(reference[k] ** 2 for k in places))


def test_five_characters_are_seen_by_one_file_alone(browser: Browser, file: Path) -> None:
    assert file.stat().st_size < 3_000_000
    with browser.page({}, (640, 480)) as page:
        asked: list[str] = []
        page.itself.on("request", lambda request: asked.append(request.url))
        opened(page, file)
        assert [url for url in asked if not url.startswith("data:")] == [file.as_uri()]
        captions = page.itself.locator("figcaption span").all_inner_texts()
        assert captions == ["Standard specular", "Lambert", *(f"Oren-Nayar σ = {sigma}" for sigma in ("0", "0.2", "0.33"))]
        for view in page.itself.locator(".view").all():
            drawn = page.call(DRAWN, b64encode(page.itself.screenshot(clip=view.bounding_box())).decode())
            assert 0.4 < drawn < 0.9  # a bust before a wall


def test_pixels_show_the_mesh_from_the_camera(page: Page, stage: five_characters.FiveCharacters, file: Path) -> None:
    found = re.search(r'"frame": (\{.*?\})', file.read_text())
    assert found
    frame = json.loads(found[1])
    mesh = stage.characters[0].subject.data
    tree = BVHTree.FromPolygons([v.co for v in mesh.vertices], [p.vertices for p in mesh.polygons])
    to_blender = Matrix.Rotation(-five_characters.YAW, 3, "Z") @ Matrix.Rotation(math.radians(90.0), 3, "X")
    pivot = Vector((0.0, frame["pivot"], 0.0))
    # the third of the five stands where a view's middle is
    beside = Vector((stage.characters[2].subject.location.x, 0.0, 0.0))
    per_meter = min(WIDTH / frame["width"], HEIGHT / frame["height"])
    normal, albedo = pixels(page, 1, "normal"), pixels(page, 1, "albedo")
    paint = mesh.attributes[ALBEDO_ATTRIBUTE].data
    agree = checked = 0
    for k in range(0, WIDTH * HEIGHT, 7):
        if not normal[4 * k + 3]:
            continue
        y, x = divmod(k, WIDTH)
        # the top of the frame is that of the view
        target = Vector(((x + 0.5 - WIDTH / 2) / per_meter, frame["top"] - (HEIGHT - y - 0.5) / per_meter, 0.0))
        eye = pivot + Vector((0.0, 0.0, frame["far"]))
        hit, _, index, _ = tree.ray_cast(to_blender @ (eye - beside), to_blender @ (target - eye))
        if index is None:
            continue
        corners, loops = list(mesh.polygons[index].vertices), mesh.polygons[index].loop_indices
        weights = poly_3d_calc([mesh.vertices[corner].co for corner in corners], hit)
        smooth = sum((w * mesh.corner_normals[c].vector for c, w in zip(loops, weights, strict=True)), Vector()).normalized()
        color = sum((w * Vector(paint[c].color[:3]) for c, w in zip(corners, weights, strict=True)), Vector()) * ALBEDO
        off = (to_blender.transposed() @ smooth - Vector(normal[4 * k : 4 * k + 3])).length
        checked += 1
        # normals in 16 bits are within 1e-4; a pixel's quad is shaded as two triangles, whose normals differ from the quad's mean
        agree += off < 0.03 and (color - Vector(albedo[4 * k : 4 * k + 3])).length < 0.03
    assert checked > 200 and agree > 0.95 * checked  # the rest are edges


@pytest.mark.parametrize(
    ("settings", "sigma"),
    [({}, 0.33), ({"sigma": "1"}, 1.0), ({"azimuth": "50", "elevation": "-10"}, 0.33)],
    ids=["as it opens", "sigma", "light"],
)
def test_formulas_are_those_of_the_models(page: Page, settings: dict[str, str], sigma: float) -> None:
    for name, value in settings.items():
        page.itself.locator(f"#{name}").fill(value)
    for look, model in enumerate((*MODELS[:-1], OrenNayar(sigma))):
        # shaders/README.md: an error of at most 2e-5 of the value; inputs that were read back are rounded as the shader's are
        assert rms(pixels(page, look, "radiance"), expected(page, look, model)) < 4e-5
    caption = page.itself.locator("figcaption span").last
    caption.get_by_text(f"= {sigma:g}").wait_for()


def nearest_eon(model: Model) -> tuple[Model, Callable[[float], float]]:
    """What glTF carries of a model's diffuse reflection, and its albedo for that of the model."""
    if not isinstance(model, OrenNayar):
        return Lambert(), lambda rho: rho
    eon = Eon(REGISTERED["oren_nayar"].eon.roughness(model.sigma))
    return eon, lambda rho: eon.color(model.average_albedo(rho))


@pytest.mark.parametrize("name", [pytest.param("Error of Lambert", marks=pytest.mark.slow), "Error of glTF"])
def test_error_is_that_of_the_formulas(page: Page, name: str) -> None:
    page.itself.get_by_role("radio", name=name).check(force=True)
    page.itself.locator("#sigma").fill("0.5")
    settled(page)
    shown = [float(text.removesuffix("%")) / 100.0 for text in page.itself.locator("figcaption output").all_inner_texts()]
    box = page.itself.locator(".view").first.bounding_box()
    assert box
    size = round(box["width"]), round(box["height"])  # of what is measured
    models, errors = (*MODELS[:-1], OrenNayar(0.5)), []
    for look, model in enumerate(models):
        other, albedo = nearest_eon(model) if name.endswith("glTF") else (Lambert(), lambda rho: rho)
        errors.append(rms(expected(page, look, other, albedo, size), expected(page, look, model, size=size)))
    for told, error in zip(shown, errors, strict=True):
        assert told == pytest.approx(error, abs=5.1e-4 if told >= 0.1 else 5.1e-5)  # told in three digits
    assert errors[3] > 0.002  # there is something to measure


def test_all_can_be_reached_on_a_phone(phone: Page) -> None:
    itself = phone.itself
    itself.locator("label", has_text="Error of Lambert").tap()  # which shows most
    settled(phone)
    assert phone.call("() => [document.documentElement.scrollWidth, innerWidth]") == [390, 390]
    assert len(itself.locator("input, button").all()) == 9
    for control in itself.locator("label, button").all():
        control.scroll_into_view_if_needed()
        box = control.bounding_box()
        assert box and box["x"] >= 0.0 and box["x"] + box["width"] <= 390.0 and box["y"] + box["height"] <= 844.0
        assert box["height"] >= 32.0  # for a finger
    for view in itself.locator("figure").all():
        box = view.bounding_box()
        assert box and box["x"] >= 0.0 and box["x"] + box["width"] <= 390.5 and box["width"] > 100.0
    itself.locator("label", has_text="Picture").tap()
    slider = itself.locator("#azimuth")
    box = slider.bounding_box()
    assert box
    itself.touchscreen.tap(box["x"] + 0.75 * box["width"], box["y"] + 0.5 * box["height"])
    # a quarter of 360 degrees to the right of the middle; the knob's width, a tenth of the slider's, takes from its ends
    assert phone.call("() => viewer.state.azimuth") == pytest.approx(90.0, abs=18.0)
    itself.get_by_role("button", name="Reset").tap()
    assert phone.call("() => viewer.state.azimuth") < 0.0


def test_fingers_turn_and_zoom(phone: Page) -> None:
    session = phone.itself.context.new_cdp_session(phone.itself)
    for kind, *points in (
        ("touchStart", (60, 150)),
        ("touchMove", (100, 150)),
        ("touchEnd",),
        ("touchStart", (60, 150), (80, 150)),
        ("touchMove", (50, 150), (90, 150)),
        ("touchEnd",),
    ):
        session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": [{"x": x, "y": y} for x, y in points]})
    state = phone.call("() => viewer.state")
    assert state["yaw"] == 20.0 and state["zoom"] == 2.0  # half a degree for a pixel; from 20 pixels to 40


def test_mouse_and_keys_turn_zoom_and_move(page: Page) -> None:
    mouse, keyboard, state = page.itself.mouse, page.itself.keyboard, "() => viewer.state"
    first = page.call(state)
    before = pixels(page, 1, "normal")
    mouse.move(60, 100)
    mouse.down()
    mouse.move(120, 80)
    mouse.up()
    dragged = page.call(state)
    assert (dragged["yaw"], dragged["pitch"]) == (30.0, -10.0)
    assert rms(pixels(page, 1, "normal"), before) > 0.1
    # turning a character turns its light: the formulas agree from there, too
    assert rms(pixels(page, 4, "radiance"), expected(page, 4, MODELS[4])) < 4e-5
    mouse.wheel(0, -200)
    keyboard.down("Shift")
    mouse.down()
    mouse.move(150, 80)
    mouse.up()
    keyboard.up("Shift")
    moved = page.call(state)
    assert moved["zoom"] > 1.2 and moved["yaw"] == dragged["yaw"] and moved["shift"] != dragged["shift"]
    page.itself.locator("#stage").focus()
    for key in ("0", "ArrowRight", "ArrowUp", "+", "Shift+ArrowLeft"):
        keyboard.press(key)
    pressed = page.call(state)
    assert (pressed["yaw"], pressed["pitch"], pressed["zoom"]) == (5.0, -5.0, 1.15) and pressed["shift"][0] < 0.0
    keyboard.press("0")
    keyboard.press("Tab")  # to what is shown, then to the first slider
    keyboard.press("Tab")
    keyboard.press("ArrowRight")
    assert page.call(state) == {**first, "sigma": 0.34}


def test_browser_without_webgl_gets_words(browser: Browser, file: Path) -> None:
    with browser.page({}, (390, 844)) as page:
        page.itself.add_init_script("HTMLCanvasElement.prototype.getContext = () => null")
        page.open(file.as_uri())
        page.itself.get_by_role("alert").get_by_text("WebGL 2").wait_for()
        assert not page.itself.locator("#controls").is_visible()
