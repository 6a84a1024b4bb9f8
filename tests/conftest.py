# SPDX-License-Identifier: GPL-3.0-or-later
"""A Blender without the user's settings for every test process, and this checkout as the package true_diffuse."""

import os
import tempfile
from collections.abc import Iterator

import pytest
from hypothesis import settings

settings.register_profile("patient", deadline=None)  # on a busy machine any example may take long
settings.load_profile("patient")

# Before bpy is imported: add-ons and settings of whoever runs the tests must not take part.
profile = tempfile.TemporaryDirectory(prefix="true_diffuse_tests_", ignore_cleanup_errors=True)
os.environ["BLENDER_USER_RESOURCES"] = profile.name

import checkout  # noqa: E402, F401


@pytest.fixture
def empty_file() -> None:
    """Start from a file with nothing in it."""
    import bpy

    bpy.ops.wm.read_factory_settings(use_empty=True)


@pytest.fixture
def registered() -> Iterator[None]:
    """Start from a file with nothing in it, with the extension enabled."""
    import bpy

    import true_diffuse

    bpy.ops.wm.read_factory_settings(use_empty=True)
    true_diffuse.register()
    yield
    true_diffuse.unregister()


@pytest.fixture(scope="session")
def eevee_runs_here() -> bool:
    from true_diffuse.addon.blender import engines

    return engines.eevee_runs_here()


@pytest.fixture
def driver(eevee_runs_here: bool) -> None:
    """Skip the test where Blender finds no graphics driver."""
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")


@pytest.fixture(scope="session")
def translations() -> dict[str, dict[str, str]]:
    """The shaders for other engines by language and stem; skips the test where what translates them is missing."""
    from true_diffuse.scripts.cli.console import BadInput
    from true_diffuse.scripts.release import shaders

    try:
        return {language: shaders.translated(language) for language in shaders.LANGUAGES}
    except BadInput as error:
        pytest.skip(str(error))


@pytest.fixture(params=["eevee", "cycles"])
def engine(request, eevee_runs_here: bool):
    from true_diffuse.addon.blender import engines

    if request.param == engines.EEVEE.key and not eevee_runs_here:
        pytest.skip("EEVEE finds no graphics driver here")
    return engines.ENGINES[request.param]
