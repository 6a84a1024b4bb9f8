# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the extension's package with Blender's own tool, has that check it, and lists what is in it.

uv run scripts/release/package.py                  writes dist/true_diffuse-VERSION.zip; seconds
uv run scripts/release/package.py --time           also tells how long Blender takes to enable it; half a minute
uv run scripts/release/package.py --repository DIR writes the package and its listing into a static repository instead
uv run scripts/release/package.py --website URL    states in the manifest where the manual's pages are
uv run scripts/release/package.py --shaders        also writes dist/true_diffuse_shaders-VERSION.zip for other engines; needs naga
blender -b --python scripts/release/package.py
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import zipfile
from collections import Counter
from functools import partial
from pathlib import Path
from statistics import median
from urllib.parse import urlsplit

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse
from true_diffuse.scripts.cli.console import BadInput, Parser, Terminal, end, script_arguments
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.cli.startup import run_script
from true_diffuse.scripts.release import shaders

ROOT = Path(__file__).resolve().parents[2]
MAX_SIZE = 750_000  # bytes of the package: a second at 6 Mbit/s, whatever targets, engines and textures there are
STARTS = 7  # of Blender, for a median
MODULE = "bl_ext.user_default.true_diffuse"
INSTALL = "import bpy; bpy.ops.extensions.package_install_files(filepath={!r}, repo='user_default', enable_on_install=False)"
ENABLE = f"""
import time, addon_utils
start = time.perf_counter()
assert addon_utils.enable({MODULE!r})
print("seconds", time.perf_counter() - start)
"""


def main() -> int:
    """Run the script; returns the exit status."""
    parser = Parser(prog="package.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "dist", metavar="DIR", help="folder to write (default: dist)")
    parser.add_argument("--time", action="store_true", help="install it in a profile of its own and time how it is enabled")
    parser.add_argument("--shaders", action="store_true", help="also pack the shaders for other engines, in GLSL, WGSL and HLSL")
    parser.add_argument("--repository", type=Path, metavar="DIR", help="write it and its listing into a static repository instead")
    parser.add_argument("--website", type=web_address, metavar="URL", help="where the manual's pages are, for the manifest")
    options = parser.parse_args(script_arguments())
    if options.repository and options.shaders:
        parser.error("--shaders packs no extension, and goes into no --repository")
    work = partial(package, options.time, options.shaders, options.website, options.repository is not None)
    return run_script("package.py", options.repository or options.out, work)


def web_address(text: str) -> str:
    """Return `text`, an address that begins with http:// or https://; raises argparse.ArgumentTypeError for others."""
    parts = urlsplit(text)
    plain = text.isascii() and text.isprintable() and not set(text) & set(' "\\<>^`{|}')  # RFC 3986 has none of them
    if parts.scheme not in ("http", "https") or not parts.hostname or not plain:
        raise argparse.ArgumentTypeError(f"no address of http or https: {text!r}")
    return text


def package(
    timed: bool, with_shaders: bool, website: str | None, is_repository: bool, output: OutputFolder, terminal: Terminal
) -> None:
    """Build the package into `output`, check it, publish it and tell what it holds; `with_shaders` those for other engines, too.

    `website` goes into its manifest. With `is_repository` the listing is written, too, and packages of other versions are removed.
    """
    packed = [shaders.archive(output.folder)] if with_shaders else []
    path = build(output.folder)
    if website:
        set_website(path, website)
    check(path)
    size = path.stat().st_size
    if size > MAX_SIZE:
        raise BadInput(f"{path.name} has {size} bytes, more than {MAX_SIZE}")
    folders: Counter[str] = Counter()
    files: Counter[str] = Counter()
    with zipfile.ZipFile(path) as content:
        for entry in content.infolist():
            folder = entry.filename.rpartition("/")[0] or "."
            folders[folder] += entry.compress_size
            files[folder] += 1
    rows = [(folder, str(files[folder]), f"{folders[folder] / 1000.0:.1f}") for folder in sorted(folders)]
    terminal.table(path.name, ("Folder", "Files", "kB"), rows)
    if timed:
        first, again = enabling(path, terminal)
        terminal.say(f"Enabled in {1000.0 * first:.0f} ms the first time, {1000.0 * again:.0f} ms later (median of {STARTS})")
    sizes = {each.name: each.stat().st_size for each in (path, *packed)}
    others = []
    if is_repository:
        others = [other for other in output.target.glob("true_diffuse-*.zip") if other.name != path.name]
        settings = output.target / "blender_repo.toml"
        kept = [other for other in output.target.glob("*.zip") if other not in others]
        for line in list_packages(output.folder, kept, settings if settings.is_file() else None):
            terminal.say(line)
    written = output.publish()
    for name in written:
        size = f", {sizes[name] / 1000.0:.0f} kB" if name in sizes else ""
        terminal.say(f"Wrote {output.target / name}{size}")
    for other in others:
        other.unlink()
        terminal.say(f"Removed {other}: a repository offers one version")


def build(folder: Path) -> Path:
    """Return the package, built into `folder`; raises BadInput with the tool's words where that fails."""
    _tool("build", f"--source-dir={ROOT}", f"--output-dir={folder}")
    return next(folder.glob("true_diffuse-*.zip"))


def set_website(path: Path, address: str) -> None:
    """State `address` as the website in the manifest of the package at `path`."""
    with zipfile.ZipFile(path) as package:
        contents = {entry: package.read(entry) for entry in package.infolist()}
    with zipfile.ZipFile(path, "w") as package:
        for entry, content in contents.items():
            if entry.filename == "blender_manifest.toml":
                content = content.replace(b"\ntype = ", f'\nwebsite = "{address}"\ntype = '.encode(), 1)
            package.writestr(entry, content, compresslevel=9)


def list_packages(folder: Path, others: list[Path], settings: Path | None = None) -> list[str]:
    """Write index.json and index.html, which list the packages in `folder` and `others`, into it; return the tool's warnings.

    `settings` is the repository's blender_repo.toml, if it has one.
    """
    kept = [other for other in others if not (folder / other.name).exists()]
    for other in kept:
        shutil.copyfile(other, folder / other.name)
    said = _tool("server-generate", f"--repo-dir={folder}", "--html", *([f"--repo-config={settings}"] if settings else []))
    for other in kept:
        (folder / other.name).unlink()
    return [line.replace(f"{folder}{os.sep}", "") for line in said.splitlines() if line.startswith(("WARN", "ERROR"))]


def check(path: Path) -> None:
    """Let Blender's tool check manifest, tags and content of a package; raises BadInput with its words where it objects."""
    _tool("validate", f"--valid-tags={_scripts() / 'modules' / '_bpy_internal' / 'extensions' / 'tags.py'}", str(path))


def _scripts() -> Path:
    import bpy

    return Path(bpy.utils.system_resource("SCRIPTS"))


def _tool(*arguments: str) -> str:
    tool = _scripts() / "addons_core" / "bl_pkg" / "cli" / "blender_ext.py"
    result = subprocess.run([sys.executable, tool, *arguments], capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise BadInput(" ".join((result.stderr or result.stdout).split()))
    return result.stdout


def enabling(path: Path, terminal: Terminal) -> tuple[float, float]:
    """Return how long Blender takes to enable the package, [s]: the first time, when Python compiles it, and later."""
    with tempfile.TemporaryDirectory() as profile:
        blender(profile, INSTALL.format(str(path)))
        times = []
        with terminal.progress(STARTS + 1) as progress:
            for start in range(STARTS + 1):
                with progress.step(f"start {start + 1}", 1.0):
                    output = blender(profile, ENABLE).splitlines()
                    times.append(next(float(line.split()[1]) for line in output if line.startswith("seconds ")))
    return times[0], median(times[1:])


def blender(profile: str, code: str) -> str:
    """Run `code` in a Blender with settings of its own in the folder `profile`; returns what it printed.

    Raises RuntimeError with its words where it fails.
    """
    import bpy

    binary = bpy.app.binary_path
    command = [binary, "--background", "--python-exit-code", "1", "--python-expr"] if binary else [sys.executable, "-c"]
    environment = os.environ | {"BLENDER_USER_RESOURCES": profile}
    result = subprocess.run(
        [*command, code if binary else f"import bpy\n{code}"], env=environment, capture_output=True, text=True, check=False
    )
    if result.returncode != 0 or "Traceback" in result.stderr:
        raise RuntimeError(result.stdout + result.stderr)
    return result.stdout


if __name__ == "__main__":
    end(main())
