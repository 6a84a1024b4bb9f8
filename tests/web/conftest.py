# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser and packages for its pages, without which tests are skipped with the reason; Blender's exporter with our extension."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import bpy

import pytest

from true_diffuse.addon.blender import properties, report
from true_diffuse.scripts.web import WebError, engines, packages
from true_diffuse.scripts.web import browser as browsers


@pytest.fixture(scope="session")
def browser() -> Iterator[browsers.Browser]:
    with ExitStack() as stack:
        try:
            made = stack.enter_context(browsers.browser())
        except WebError as error:
            pytest.skip(str(error))
        yield made


@pytest.fixture(scope="session")
def node_modules() -> Path:
    try:
        return packages.node_modules()
    except WebError as error:
        pytest.skip(str(error))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the files that `engine` loads."""
    return tmp_path_factory.mktemp("files")


@pytest.fixture(scope="module", params=engines.PAGES)
def engine(request, browser: browsers.Browser, folder: Path) -> Iterator[engines.Engine]:
    request.getfixturevalue("node_modules")
    with engines.engine(request.param, browser, folder) as made:
        yield made


@pytest.fixture
def exporter() -> Iterator[None]:
    """A file with nothing in it, and the extension among the add-ons that Blender's glTF exporter asks."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    addon = bpy.context.preferences.addons.new()
    addon.module = "true_diffuse"
    properties.register()
    yield
    report.take()
    properties.unregister()
    bpy.context.preferences.addons.remove(addon)
