# SPDX-License-Identifier: GPL-3.0-or-later
"""The archive of shaders for other engines: WGSL and HLSL made by naga, whole, and compiled by another compiler where that is here.

What they compute is in web/test_translations.py.
"""

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from support import SCRIPTS
from true_diffuse.addon.blender.glsl import SHADERS, includes, source
from true_diffuse.addon.models import MODELS
from true_diffuse.scripts.cli.console import BadInput
from true_diffuse.scripts.release import shaders

STEMS = [path.stem for path in SHADERS.glob("*.glsl")]


@pytest.mark.parametrize("language", shaders.LANGUAGES)
def test_every_model_has_its_functions(language: str, translations: dict[str, dict[str, str]]) -> None:
    for model in (*MODELS, "blinn_phong"):
        files = dict.fromkeys(("surface", "radiance"), model)
        if model != "blinn_phong":
            if MODELS[model].parameter:
                files["coefficients"] = model
            files["albedo"] = MODELS[model].glsl.albedo_stem or model
        for name, stem in files.items():
            before, after = {"wgsl": ("fn ", r"\) -> \w+.* \{$"), "hlsl": (r"\w+ ", r"\)$")}[language]
            assert len(re.findall(f"^{before}{model}_{name}\\(.*{after}", translations[language][stem], re.MULTILINE)) == 1


@pytest.mark.parametrize("language", shaders.LANGUAGES)
def test_file_says_what_it_is_and_includes(language: str, translations: dict[str, dict[str, str]]) -> None:
    assert set(translations[language]) == set(STEMS)
    for stem, text in translations[language].items():
        license_line, made = text.splitlines()[:2]
        assert license_line == "// SPDX-License-Identifier: GPL-3.0-or-later"
        assert made == f"// Translated from {stem}.glsl by naga {shaders.NAGA}."
        assert f"{shaders.LANGUAGES[language]}; functions only" in text and "GLSL 3.30" not in text
        for name in includes(stem):
            assert f"{name}.{language}" in text


@pytest.mark.parametrize("language", shaders.LANGUAGES)
def test_comments_are_those_of_the_glsl(language: str, translations: dict[str, dict[str, str]]) -> None:
    for stem, text in translations[language].items():
        glsl = (SHADERS / f"{stem}.glsl").read_text().replace("GLSL 3.30 and ES 3.00 (under precision highp float)", "")
        # those of whole lines at the margin, each where its function or struct is: in the same order
        kept = [line for line in text.splitlines() if line.startswith("//")]
        del kept[1]
        expected = [line.replace(".glsl", f".{language}") for line in glsl.splitlines() if line.startswith("//")]
        name = shaders.LANGUAGES[language]
        assert [line.replace(f"{name}; functions only", "; functions only") for line in kept] == expected, stem


@pytest.mark.parametrize("stem", STEMS)
def test_hlsl_compiles(stem: str, translations: dict[str, dict[str, str]], tmp_path: Path) -> None:
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("glslangValidator is not installed, Khronos' compiler of HLSL")
    text = "\n".join(translations["hlsl"][name] for name in (*includes(stem), stem))
    for entry, status in ("float4 main() : SV_Target { return 0; }", 0), ("float4 main() : SV_Target { return lost(); }", 2):
        path = tmp_path / "shader.hlsl"
        path.write_text(f"{text}\n{entry}\n")
        command = [compiler, "-D", "-V", "-S", "frag", "-e", "main", "-o", tmp_path / "shader.spv", path]
        assert subprocess.run(command, capture_output=True, check=False).returncode == status


@pytest.mark.usefixtures("translations")
def test_archive_is_whole_and_always_the_same(tmp_path: Path) -> None:
    folders = tmp_path / "a", tmp_path / "b"
    for folder in folders:
        folder.mkdir()
    first, second = map(shaders.archive, folders)
    assert first.read_bytes() == second.read_bytes()
    names = zipfile.ZipFile(first).namelist()
    translated = {f"{language}/{stem}.{language}" for language in shaders.LANGUAGES for stem in STEMS}
    assert {*translated, *(f"{stem}.glsl" for stem in STEMS), "README.md", "LICENSE", "engines/three.js"} <= set(names)
    assert len(names) == len(set(names))


@pytest.mark.parametrize("page", [SHADERS / "README.md", SCRIPTS / "README.md", SCRIPTS.parent / ".ci" / "run"])
def test_page_names_the_version_of_naga(page: Path) -> None:
    assert set(re.findall(r"naga-cli\s+--version (\S+)", page.read_text())) == {shaders.NAGA}


def fake_naga(folder: Path, version: str) -> str:
    """A PATH with a program naga alone, which only tells its version."""
    program = folder / "naga"
    program.write_text(f"#!{sys.executable}\nprint({version!r})\n")
    program.chmod(0o755)
    return str(folder)


@pytest.mark.skipif(sys.platform == "win32", reason="a program is no script there")
def test_other_version_of_naga_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", fake_naga(tmp_path, "29.0.0"))
    with pytest.raises(BadInput, match=r"version 29\.0\.0, not .* cargo install naga-cli --version"):
        shaders.translated("wgsl")


def test_package_without_naga_is_one_line(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    out = tmp_path / "dist"
    command = [sys.executable, SCRIPTS / "release" / "package.py", "--shaders", "--out", out]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    (line,) = done.stderr.splitlines()
    assert done.returncode == 2 and f"cargo install naga-cli --version {shaders.NAGA}" in line
    assert not out.exists()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("fn eon_surface(", "fn surface(", "surface, which no file"),
        ("fn eon_surface() {\n    return;\n}\n", "", "writes no eon_surface"),
        ("fn main(", "const LOST = 1;\nfn main(", "LOST, which no file"),
        ("fn main(", "@lost\nfn main(", "but '@lost'"),
    ],
)
def test_what_a_translation_lost_or_added_raises(old: str, new: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    glsl = source(*shaders.stems())
    names = re.findall(r"^(?:struct|\w+) (\w+)(?: \{|\()", glsl, re.MULTILINE)
    whole = "\n\n".join(f"fn {name}() {{\n    return;\n}}" for name in (*names, "main")) + "\n"
    monkeypatch.setattr(shaders, "naga", lambda *_: whole)
    shaders.translated("wgsl")
    monkeypatch.setattr(shaders, "naga", lambda *_: whole.replace(old, new))
    with pytest.raises(RuntimeError, match=said):
        shaders.translated("wgsl")
