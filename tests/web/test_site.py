# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's site, made by Sphinx and opened in a browser: from the disk, without a network, on a phone, in the dark."""

import re
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from true_diffuse.scripts.release import website
from true_diffuse.scripts.web.browser import Browser

pytestmark = pytest.mark.web

PHONE = 390, 844
DESKTOP = 1280, 900


class Page(HTMLParser):
    """A page's ids, the targets of its links, and what it loads."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.ids: set[str] = set()
        self.links: list[str] = []
        self.loaded: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = dict(attrs)
        self.ids.add(given.get("id") or "")
        if tag == "a":
            self.links.append(given.get("href") or "")
        elif tag in ("img", "script", "link"):
            self.loaded += [given[name] or "" for name in ("src", "href") if name in given]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("sphinx", reason="Sphinx is not installed: uv run --group site")
    folder = tmp_path_factory.mktemp("made") / "site"
    command = [sys.executable, website.ROOT / "scripts/release/manual.py", "--site", folder]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Page]:
    return {path: Page(path) for path in site.rglob("*.html")}


def test_site_has_every_page(pages: dict[Path, Page], site: Path) -> None:
    written = {path.replace(".md", ".html") for path in (*website.pages().values(), website.GALLERY)}
    assert {path.relative_to(site).as_posix() for path in pages} == {*written, "search.html"}


def test_no_link_or_picture_is_broken(pages: dict[Path, Page]) -> None:
    checked = 0
    for path, page in pages.items():
        for target in (*page.links, *page.loaded):
            parts = urlsplit(target)
            if not parts.scheme:
                linked = (path.parent / unquote(parts.path)).resolve() if parts.path else path
                assert linked.is_file(), (path.name, target)
                assert not parts.fragment or linked not in pages or parts.fragment in pages[linked].ids, (path.name, target)
                checked += 1
    assert checked > 500


def test_nothing_is_loaded_from_elsewhere(pages: dict[Path, Page], site: Path) -> None:
    assert not [(path.name, target) for path, page in pages.items() for target in page.loaded if urlsplit(target).netloc]
    for style in site.rglob("*.css"):
        assert not re.findall(r"(?:url\(|@import)\s*[\"']?(?:https?:)?//", style.read_text(encoding="utf-8")), style.name


@pytest.mark.parametrize("from_disk", [True, False])
def test_search_finds_a_material_and_leads_to_it(site: Path, browser: Browser, from_disk: bool) -> None:
    with browser.page({"site": site}, DESKTOP) as page:
        page.open((site / "index.html").as_uri() if from_disk else "/site/index.html")
        page.itself.locator("input[name=q]").fill("chalk")
        page.itself.keyboard.press("Enter")
        found = page.itself.locator("#search-results li", has_text="Gallery > Chalk")
        found.wait_for()
        if not from_disk:
            found.get_by_text("White chalk").wait_for()  # a summary, which needs a server
        found.locator("a").first.click()
        page.itself.wait_for_url("**/gallery.html*#chalk")
        assert page.itself.locator("#chalk img").evaluate("image => image.naturalWidth") == 128


def test_pages_fit_a_phone_in_light_and_dark(pages: dict[Path, Page], browser: Browser) -> None:
    for path in pages:
        with browser.page({}, PHONE, touch=True) as page:
            backgrounds = []
            for scheme in ("light", "dark"):
                page.itself.emulate_media(color_scheme=scheme)
                page.open(path.as_uri())
                assert page.call("() => document.documentElement.scrollWidth") == PHONE[0], path.name
                color = page.call("() => getComputedStyle(document.body).backgroundColor")
                backgrounds.append(sum(map(int, re.findall(r"\d+", color)[:3])) / 3.0)
            assert backgrounds[0] > 200.0 and backgrounds[1] < 50.0
