# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws glTF files with three.js and Babylon.js: linear floats of every pixel, lit by directional lights alone."""

from array import array
from collections.abc import Generator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from true_diffuse.addon.blender.glsl import SHADERS
from true_diffuse.scripts.web.browser import Browser, Page
from true_diffuse.scripts.web.packages import node_modules

ROOM = Path(__file__).parent
THREE, BABYLON = "three.js", "Babylon.js"
PAGES = {THREE: "three.html", BABYLON: "babylon.html"}  # by the engines' names
RADIANCE, ALBEDO, POSITION, NORMAL = "radiance", "albedo", "position", "normal"  # what a pixel shows

type Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Camera:
    """A camera of square pictures, `size` pixels across, that sees `degrees` from top to bottom.

    The points `eye` and `at` [m] are in Blender's axes, as are all of this module; `at` is in the middle, and Z is up. It sees what
    is between `near` and `far` [m] from it.
    """

    size: int
    eye: Triple
    at: Triple
    degrees: float
    near: float
    far: float


@dataclass(frozen=True)
class Sun:
    """A directional light: the `direction` towards it (unit vector), and the linear RGB of its `irradiance` E0 [W/m^2]."""

    direction: Triple
    irradiance: Triple


class Engine:
    """A web engine on a page of its own."""

    def __init__(self, name: str, page: Page, files: Path) -> None:
        self.name = name
        self._page = page
        self._files = files
        self._size = 0

    def load(self, file: Path, camera: Camera) -> None:
        """Load a .glb or .gltf file, which lies in the folder of files, to be seen by `camera`. Raises WebError."""
        self._size = camera.size
        self._page.call(
            "scene => load(scene)",
            {
                "file": f"/files/{file.relative_to(self._files).as_posix()}",
                "size": camera.size,
                "eye": _to_gltf(camera.eye),
                "at": _to_gltf(camera.at),
                "degrees": camera.degrees,
                "near": camera.near,
                "far": camera.far,
            },
        )

    def call(self, function: str, argument: object = None) -> object:
        """Return what `Page.call` does, where `scene` is the engine's and /shaders the folder shaders. Raises WebError."""
        return self._page.call(function, argument)

    def draw(self, what: str, suns: Sequence[Sun] = ()) -> tuple[array[float], bytearray]:
        """Return three floats of each pixel, rows from the top, and 1 for each pixel that shows anything, else 0.

        RADIANCE [W/(m^2 sr)] is in linear RGB and that under `suns`, without shadows; ALBEDO is the base color, linear RGB;
        POSITION [m] and NORMAL, of any length and without normal maps, are in Blender's axes. Raises WebError.
        """
        suns_there = [{"direction": _to_gltf(sun.direction), "irradiance": sun.irradiance} for sun in suns]
        rgba = self._page.floats("([what, suns]) => draw(what, suns)", [what, suns_there])
        values, shown = array("f"), bytearray()
        row = 4 * self._size
        for start in range(len(rgba) - row, -1, -row):
            for i in range(start, start + row, 4):
                x, y, z, alpha = rgba[i : i + 4]
                values.extend((x, -z, y) if what in (POSITION, NORMAL) else (x, y, z))
                shown.append(alpha > 0.0)
        return values, shown


def _to_gltf(vector: Triple) -> Triple:
    """Return a vector in Blender's axes, where Z is up, in glTF's, where Y is."""
    x, y, z = vector
    return x, z, -y


@contextmanager
def engine(name: str, browser: Browser, files: Path) -> Generator[Engine]:
    """Yield the engine of a name in PAGES, on a new page of `browser` that sees the folder `files`. Raises WebError."""
    with browser.page({"web": ROOM, "npm": node_modules(), "files": files, "shaders": SHADERS}) as page:
        page.open(f"/web/{PAGES[name]}")
        page.call("() => new Promise(done => { const wait = () => window.draw ? done(null) : setTimeout(wait, 10); wait() })")
        yield Engine(name, page, files)
