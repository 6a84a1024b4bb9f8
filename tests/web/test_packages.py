# SPDX-License-Identifier: GPL-3.0-or-later
"""Packages are fetched once, whole or not at all, and what goes wrong is one line. A script stands in for npm."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from true_diffuse.scripts.web import WebError, packages

pytestmark = [pytest.mark.web, pytest.mark.skipif(os.name == "nt", reason="the script that stands in for npm is one of a shell")]


@pytest.fixture
def needed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package.json, with an empty cache and nothing on the PATH but the system's own tools."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", f"{tmp_path / 'bin'}:/bin")
    (tmp_path / "bin").mkdir()
    path = tmp_path / "package.json"
    path.write_text('{"dependencies": {"one": "1.0.0"}}')
    return path


def npm(needed: Path, script: str) -> None:
    path = needed.parent / "bin" / "npm"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)


def fetch(needed: Path) -> Path:
    return packages.node_modules.__wrapped__(needed)  # as another process does


def test_packages_are_fetched_once_for_each_package_json(needed: Path) -> None:
    npm(needed, f"mkdir node_modules; cp package.json node_modules; echo x >> {needed.parent}/runs")
    first = fetch(needed)
    assert fetch(needed) == first and (first / "package.json").read_text() == needed.read_text()
    needed.write_text('{"dependencies": {"one": "1.0.1"}}')
    assert (fetch(needed) / "package.json").read_text() == needed.read_text()
    assert first.is_dir() and (needed.parent / "runs").read_text() == "x\n" * 2


def test_two_that_fetch_at_once_get_the_same(needed: Path) -> None:
    npm(needed, "sleep 0.3; mkdir node_modules; echo $$ > node_modules/who")
    with ThreadPoolExecutor() as pool:
        one, other = pool.map(fetch, [needed, needed])
    assert one == other and (one / "who").is_file()
    assert [path.name for path in packages.cache_folder().iterdir()] == [one.parent.name]


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("echo 'npm error code ENOTFOUND' >&2; echo 'npm error network no such host' >&2; exit 1", "network no such host"),
        ("exit 3", "status 3"),
        (None, "npm is not installed"),
    ],
)
def test_failure_is_one_line_and_leaves_nothing(needed: Path, script: str | None, said: str) -> None:
    if script:
        npm(needed, script)
    elif Path("/bin/npm").exists():
        os.environ["PATH"] = str(needed.parent / "bin")  # which monkeypatch puts back
    with pytest.raises(WebError, match=said) as caught:
        fetch(needed)
    assert "\n" not in str(caught.value)
    assert not packages.cache_folder().exists() or not list(packages.cache_folder().iterdir())
