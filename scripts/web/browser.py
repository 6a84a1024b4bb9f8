# SPDX-License-Identifier: GPL-3.0-or-later
"""A headless Chromium that draws WebGL in software, and pages in it that have only the files they are given.

Playwright drives the Chromium that is installed; it fetches none of its own.
"""

import os
import shutil
import signal
from array import array
from base64 import b64decode
from collections.abc import Generator, Mapping
from contextlib import contextmanager
from pathlib import Path
from threading import Timer
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlsplit

from true_diffuse.scripts.web import WebError

try:
    from playwright.sync_api import Error, sync_playwright
except ImportError:
    Error, sync_playwright = OSError, None

if TYPE_CHECKING:
    from playwright import sync_api as playwright

VARIABLE = "TRUE_DIFFUSE_CHROMIUM"  # the environment variable with the path of a Chromium
NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
OPTIONS = (
    "--headless=new",  # the old one lacks the graphics process
    "--no-sandbox",  # which root cannot have; the pages are our own
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--disable-sync",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--host-resolver-rules=MAP * ~NOTFOUND",  # no host has an address
)
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")  # what draws WebGL, of the browser's own
DRIVER = ("--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist")  # the machine's OpenGL, as Blender takes it
ORIGIN = "http://localhost"  # of the pages: of a secure context, as some interfaces of the browser need. No server is there
TIME_LIMIT = 120.0  # seconds, of a call


def chromium() -> str:
    """Return the path of the Chromium to use: what VARIABLE says, else the first of NAMES that is installed. Raises WebError."""
    given = os.environ.get(VARIABLE)
    if given:
        if not shutil.which(given):
            raise WebError(f"{VARIABLE} is {given}, which is no program")
        return given
    found = next(filter(None, map(shutil.which, NAMES)), None)
    if found is None:
        raise WebError(f"no Chromium is installed, and {VARIABLE} names none")
    return found


class Page:
    """An open page. `itself` is Playwright's: its mouse, touchscreen, keyboard, locators and screenshots."""

    def __init__(self, itself: "playwright.Page", files: Mapping[str, Path | str], process: int) -> None:
        self.itself = itself
        self._files = files
        self._process = process
        self._errors: list[str] = []
        itself.on("pageerror", lambda error: self._errors.append(str(error)))
        itself.on("console", lambda message: self._errors.append(message.text) if message.type == "error" else None)
        itself.route("**/*", self._answer)

    def open(self, url: str) -> None:
        """Open one of its own files, by a path that begins with "/", or a file of the disk, by its file: URL."""
        with self._limited(TIME_LIMIT):
            self.itself.goto(url if url.startswith("file:") else ORIGIN + url, timeout=1e3 * TIME_LIMIT)

    def call(self, function: str, argument: object = None, time_limit: float = TIME_LIMIT) -> Any:  # noqa: ANN401 - JSON
        """Return what a JavaScript `function` of one `argument`, or the promise it returns, comes to: anything that JSON holds.

        Raises WebError where it throws, where the page has written an error to its console, has failed, or has asked for what it
        was not given, and after `time_limit` seconds, which end the browser.
        """
        with self._limited(time_limit):
            return self.itself.evaluate(function, argument)

    def floats(self, function: str, argument: object = None, time_limit: float = TIME_LIMIT) -> array[float]:
        """Return what `call` does of a function that gives the base64 of 32-bit floats."""
        return array("f", b64decode(self.call(function, argument, time_limit)))

    def check(self) -> None:
        """Raise WebError where the page has written an error to its console, has failed, or has asked for what it was not given."""
        if self._errors:
            text = "; ".join(dict.fromkeys(self._errors))
            self._errors.clear()
            raise WebError(" ".join(text.split()))

    @contextmanager
    def _limited(self, seconds: float) -> Generator[None]:
        """Raise WebError for what goes wrong within the body, which the end of the browser cuts off after so many `seconds`."""
        late = False

        def end() -> None:
            nonlocal late
            late = True
            os.kill(self._process, signal.SIGTERM if os.name == "nt" else signal.SIGKILL)

        timer = Timer(seconds, end)
        timer.start()
        try:
            yield
        except Error as error:
            if late:
                raise WebError(f"the page was not done within {seconds:g} s") from None
            self.check()
            raise WebError(" ".join(str(error).split())) from error
        finally:
            timer.cancel()
        self.check()

    def _answer(self, route: "playwright.Route") -> None:
        """Answer a request of the page by one of its files."""
        url = route.request.url
        parts = urlsplit(url)
        if parts.scheme == "file":
            route.continue_()
            return
        _, mount, *path = unquote(parts.path).split("/")
        found = self._files.get(mount) if f"{parts.scheme}://{parts.netloc}" == ORIGIN else None
        if isinstance(found, str) and not path:
            route.fulfill(body=found, content_type="text/html")
        elif isinstance(found, Path) and ".." not in path and found.joinpath(*path).is_file():
            route.fulfill(path=found.joinpath(*path))
        else:
            if mount != "favicon.ico":
                self._errors.append(f"the page asked for {url}")
            route.abort()


class Browser:
    """A running browser; `version` is what it calls itself."""

    def __init__(self, itself: "playwright.Browser") -> None:
        self.version = itself.version
        self._itself = itself
        self._process = next(process["id"] for process in self._processes() if process["type"] == "browser")

    def processor_time(self) -> float:
        """Return the processor time that all processes of the browser have taken [s], in steps of some 10 ms."""
        return sum(process["cpuTime"] for process in self._processes())

    def _processes(self) -> list[dict[str, Any]]:
        return self._itself.new_browser_cdp_session().send("SystemInfo.getProcessInfo")["processInfo"]

    @contextmanager
    def page(self, files: Mapping[str, Path | str], size: tuple[int, int] = (1280, 720), touch: bool = False) -> Generator[Page]:
        """Yield a new page that has these files alone, of a window of `size` pixels, as of a phone where it has `touch`.

        `files` are by the first part of their path: a folder, a file, or the text of a file of HTML. Raises WebError at the end
        where `Page.check` does.
        """
        context = self._itself.new_context(
            viewport={"width": size[0], "height": size[1]}, has_touch=touch, is_mobile=touch, service_workers="block"
        )
        try:
            page = Page(context.new_page(), files, self._process)
            yield page
            page.check()
        finally:
            context.close()


@contextmanager
def browser(drawn_by: tuple[str, ...] = SOFTWARE) -> Generator[Browser]:
    """Yield a new browser, with a profile of its own that is removed; `drawn_by` is SOFTWARE or DRIVER.

    Raises WebError where it cannot be had.
    """
    if sync_playwright is None:
        raise WebError("the package playwright is not installed, which drives the browser (uv run --group web ...)")
    path = chromium()
    with sync_playwright() as driver:
        try:
            itself = driver.chromium.launch(executable_path=path, args=[*OPTIONS, *drawn_by])
        except Error as error:
            raise WebError(f"{path} does not start: {str(error).splitlines()[0]}") from error
        try:
            yield Browser(itself)
        finally:
            itself.close()
