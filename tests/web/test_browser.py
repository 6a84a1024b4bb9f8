# SPDX-License-Identifier: GPL-3.0-or-later
"""The harness: floats come out of WebGL as they are, and whatever goes wrong in a page is one line."""

import subprocess
import sys
from pathlib import Path

import pytest

from support import SCRIPTS, assert_bad_input, run_script
from true_diffuse.scripts.web import WebError, packages
from true_diffuse.scripts.web.browser import VARIABLE, Browser, chromium

pytestmark = pytest.mark.web

CLEAR = """values => {
  const gl = document.createElement("canvas").getContext("webgl2")
  if (!gl.getExtension("EXT_color_buffer_float")) throw Error("no float targets")
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture())
  gl.texStorage2D(gl.TEXTURE_2D, 1, gl.RGBA32F, 1, 1)
  gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer())
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, gl.getParameter(gl.TEXTURE_BINDING_2D), 0)
  gl.clearBufferfv(gl.COLOR, 0, values)
  const pixels = new Float32Array(4)
  gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.FLOAT, pixels)
  return btoa(String.fromCharCode(...new Uint8Array(pixels.buffer)))
}"""


def test_floats_are_neither_clipped_nor_rounded(browser: Browser) -> None:
    values = [3.5, -0.25, 2.0**-20, 1.0]  # which 32 bits hold exactly
    with browser.page({"": ""}) as page:
        page.open("/")
        assert list(page.floats(CLEAR, values)) == values


@pytest.mark.parametrize(
    ("function", "said"),
    [
        ("() => { throw Error('broken') }", "broken"),
        ("() => console.error('two\\nlines')", "two lines"),
        ("() => fetch('/lost.glb').catch(() => 0)", "asked for http://localhost/lost.glb"),
        ("() => fetch('https://example.com/').catch(() => 0)", "asked for https://example.com/"),
        ("() => fetch('/web/../../README.md').catch(() => 0)", "asked for"),
    ],
)
def test_failure_of_a_page_is_one_line(browser: Browser, function: str, said: str) -> None:
    folder = Path(packages.__file__).parent
    with browser.page({"": "", "web": folder}) as page:
        page.open("/")
        with pytest.raises(WebError, match=said) as caught:
            page.call(function)
            page.call("() => 0")
    assert "\n" not in str(caught.value)


ENDLESS = """
import sys
sys.path.insert(0, sys.argv[1])
import checkout
from true_diffuse.scripts.web import WebError, browser
try:
    with browser.browser() as own, own.page({"": ""}) as page:
        page.open("/")
        page.call("() => { for (;;); }", time_limit=1.0)
except WebError as error:
    print(error)
"""


@pytest.mark.usefixtures("browser")
def test_page_that_never_ends_is_one_line() -> None:
    # in a process of its own, as the browser ends with it
    result = subprocess.run([sys.executable, "-c", ENDLESS, SCRIPTS], capture_output=True, text=True, check=False, timeout=60)
    assert (result.stdout, result.stderr) == ("the page was not done within 1 s\n", "")


def test_page_is_a_window_or_a_phone(browser: Browser) -> None:
    html = (
        "<meta name=viewport content='width=device-width'><body style='margin: 0'><input type=range style='width: 100%; margin: 0'>"
    )
    with browser.page({"": html}, (300, 200), touch=True) as page:
        page.open("/")
        page.itself.touchscreen.tap(280, 10)
        assert page.call("() => [innerWidth, Number(document.querySelector('input').value) > 85]") == [300, True]


def test_three_is_the_version_that_package_json_names(browser: Browser, node_modules: Path) -> None:
    with browser.page({"": "", "npm": node_modules}) as page:
        page.open("/")
        revision = page.call("async () => (await import('/npm/three/build/three.module.js')).REVISION")
    assert f'"three": "0.{revision}.0"' in packages.NEEDED.read_text()


def test_chromium_that_is_not_there_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "none"))
    with pytest.raises(WebError, match="which is no program"):
        chromium()
    monkeypatch.delenv(VARIABLE)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(WebError, match="no Chromium is installed"):
        chromium()


def test_accuracy_without_a_browser_is_one_line_and_status_2(tmp_path: Path) -> None:
    result = run_script("accuracy.py", "--only", "web", cwd=tmp_path, **{VARIABLE: str(tmp_path / "none")})
    assert_bad_input(result, "accuracy.py: error: ")
    assert "which is no program" in result.stderr and not list(tmp_path.iterdir())
