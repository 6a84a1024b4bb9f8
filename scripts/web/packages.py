# SPDX-License-Identifier: GPL-3.0-or-later
"""The packages of a package.json, fetched once by npm and kept in the user's cache."""

import hashlib
import os
import shutil
import subprocess
import tempfile
from functools import cache
from pathlib import Path

from true_diffuse.scripts.web import WebError

NEEDED = Path(__file__).with_name("package.json")
GODOT = NEEDED.parent / "godot" / NEEDED.name
KHRONOS = NEEDED.parent / "khronos" / NEEDED.name
MODULES = "node_modules"
OPTIONS = ("--no-package-lock", "--ignore-scripts", "--no-audit", "--no-fund", "--loglevel=error")
TIME_LIMIT = 600.0  # seconds, of a download of 60 MB


@cache
def node_modules(needed: Path = NEEDED) -> Path:
    """Return the folder with the packages of a package.json, fetched first where it is not in the cache.

    The cache is the folder true_diffuse of $XDG_CACHE_HOME or ~/.cache. Another package.json gets another folder in it, which is
    whole or not there, whoever fetches at the same time. Raises WebError where npm is missing or fails, as without a network.
    """
    text = needed.read_bytes()
    kept = cache_folder() / f"npm-{hashlib.sha256(text).hexdigest()[:16]}"
    if not kept.is_dir():
        npm = shutil.which("npm")
        if npm is None:
            raise WebError("npm is not installed, which fetches the packages")
        kept.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="npm.", dir=kept.parent) as folder:
            made = Path(folder, "made")
            made.mkdir()
            (made / needed.name).write_bytes(text)
            _install(npm, made)
            try:
                made.rename(kept)
            except OSError:  # another process was faster
                if not kept.is_dir():
                    raise
    return kept / MODULES


def cache_folder() -> Path:
    """Return the folder for what can be fetched again, which need not exist."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache", "true_diffuse")


def _install(npm: str, folder: Path) -> None:
    command = [npm, "install", *OPTIONS]
    try:
        result = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False, timeout=TIME_LIMIT)
    except subprocess.TimeoutExpired:
        raise WebError(f"npm has not fetched the packages within {TIME_LIMIT:g} s") from None
    if result.returncode:
        said = [line.removeprefix("npm error ") for line in result.stderr.splitlines() if line.startswith("npm error ")]
        reason = next(
            (line for line in said if not line.startswith(("code ", "errno ", "syscall "))), f"status {result.returncode}"
        )
        raise WebError(f"npm cannot fetch the packages: {reason}")
