# SPDX-License-Identifier: GPL-3.0-or-later
"""A browser and the packages for the pages in it; tests are skipped, with the reason, where they cannot be had."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from true_diffuse.scripts.web import WebError, packages
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
