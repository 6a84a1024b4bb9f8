# SPDX-License-Identifier: GPL-3.0-or-later
"""Packs the shaders for other engines than Blender: the GLSL functions of shaders/ as they are, and in WGSL and HLSL by naga.

naga, the shader translator of the project wgpu, keeps names and arithmetic, and needs no entry point to keep a function. It is used
in one version, as another may write something else: `cargo install naga-cli --version 30.0.1 --locked`, two minutes.
"""

import re
import shutil
import subprocess
import tempfile
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

from true_diffuse.addon.blender.glsl import SHADERS, includes, own_text, source
from true_diffuse.scripts.cli.console import BadInput

ROOT = Path(__file__).resolve().parents[2]
NAGA = "30.0.1"
LANGUAGES = {"wgsl": "WGSL", "hlsl": "HLSL"}  # by the end of a file's name, which tells naga
HEAD = "GLSL 3.30 and ES 3.00 (under precision highp float)"  # in every file of GLSL
# In GLSL, with the comments and empty lines before it; then as naga writes it.
DECLARATION = re.compile(r"((?:^(?://.*)?\n)*)^(?:struct|\w+) (\w+)(?: \{|\()", re.MULTILINE)
DEFINITION = re.compile(r"^(?:struct|\w+) (\w+).*?^\};?\n", re.MULTILINE | re.DOTALL)


def archive(folder: Path) -> Path:
    """Return true_diffuse_shaders-VERSION.zip, written into `folder`: shaders/ for other engines, its GLSL also as WGSL and HLSL.

    Raises BadInput where naga is missing or of another version.
    """
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))["version"]
    files = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "LICENSE", SHADERS / "README.md")}
    files |= {f"engines/{path.name}": path.read_text(encoding="utf-8") for path in (SHADERS / "engines").iterdir()}
    files |= {f"{stem}.glsl": own_text(stem) for stem in stems()}
    files |= {f"{language}/{stem}.{language}": text for language in LANGUAGES for stem, text in translated(language).items()}
    path = folder / f"true_diffuse_shaders-{version}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as content:
        for name in sorted(files):
            entry = zipfile.ZipInfo(name)  # of 1980, so that the same files make the same archive
            entry.compress_type = zipfile.ZIP_DEFLATED
            content.writestr(entry, files[name])
    return path


def stems() -> list[str]:
    """Return the names of the files of functions in shaders/, each after those it includes."""
    names = sorted(path.stem for path in SHADERS.glob("*.glsl"))
    return list(dict.fromkeys(name for stem in names for name in (*includes(stem), stem)))


def translated(language: str) -> dict[str, str]:
    """Return each file of `stems` in a language of LANGUAGES: what it declares, in its order, with its comments.

    Raises BadInput where naga is missing or of another version, RuntimeError with its words where it fails, and where it has left
    something out or written what no file has.
    """
    declared = {name: stem for stem in stems() for _, name in _declarations(stem)}
    written: dict[str, list[str]] = {name: [] for name in declared}
    text = naga(f"#version 450\n{source(*stems())}\nvoid main() {{}}\n", language)
    for match in DEFINITION.finditer(text):
        name = match[1].removeprefix("Construct").rstrip("_")  # what HLSL has for constructors; digits get a "_"
        if name in written:
            written[name].append(match[0])
        elif name not in ("main", "main_1"):
            raise RuntimeError(f"naga {NAGA} writes {name}, which no file of shaders/ declares")
    missing = [name for name, definitions in written.items() if not definitions]
    rest = DEFINITION.sub("", text).replace("@fragment", "").strip()
    if missing or rest:
        raise RuntimeError(f"naga {NAGA} writes no {', '.join(missing)}, but {rest[:200]!r}")
    return {stem: _file(stem, language, written) for stem in stems()}


def _declarations(stem: str) -> Iterator[tuple[str, str]]:
    """Yield each struct's and function's name in shaders/STEM.glsl, after what is before it: comments and empty lines."""
    for match in DECLARATION.finditer(own_text(stem)):
        yield match[1], match[2]


def _file(stem: str, language: str, written: dict[str, list[str]]) -> str:
    text = "".join(before + "\n".join(written[name]) for before, name in _declarations(stem))
    text = text.replace(HEAD, LANGUAGES[language]).replace(".glsl", f".{language}")
    return text.replace("\n", f"\n// Translated from {stem}.glsl by naga {NAGA}.\n", 1)


def naga(glsl: str, language: str) -> str:
    """Return a fragment shader, with `main`, in a language of LANGUAGES.

    Raises BadInput where naga is missing or of another version, RuntimeError with its words where it fails.
    """
    program = shutil.which("naga")
    install = f"cargo install naga-cli --version {NAGA} --locked"
    if program is None:
        raise BadInput(f"naga is not installed, which translates the shaders: {install}")
    version = _run(program, "--version").strip()
    if version != NAGA:
        raise BadInput(f"naga is of version {version}, not {NAGA}: {install}")
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder, "shaders.glsl"), Path(folder, f"shaders.{language}")
        given.write_text(glsl, encoding="utf-8")
        _run(program, "--input-kind", "glsl", "--shader-stage", "frag", str(given), str(made))
        return made.read_text(encoding="utf-8")


def _run(*command: str) -> str:
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    if result.returncode != 0:
        raise RuntimeError(result.stderr or result.stdout)
    return result.stdout
