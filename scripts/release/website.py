# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's site: the checkout's Markdown pages and a gallery from the presets, made into static HTML by Sphinx.

A page is written once, for the repository; here its links are turned to those of the site. Sphinx comes with the group `site` of
pyproject.toml. Its theme has no fonts or scripts from elsewhere and its search no server, so the pages also work from the disk.
"""

import io
import os
import re
import shutil
import tomllib
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from true_diffuse.scripts.cli.console import BadInput

if TYPE_CHECKING:
    from true_diffuse.addon.material.presets import Preset

ROOT = Path(__file__).resolve().parents[2]
STYLE = Path(__file__).with_suffix(".css")
MANUAL = "scripts/manual"
GALLERY = "gallery.md"
# The pages beside the manual's, by path in the checkout: their path in the site.
PAGES = {
    "README.md": "index.md",
    "addon/usd/README.md": "usd.md",
    "addon/gltf/README.md": "gltf.md",
    "shaders/README.md": "shaders.md",
    "scripts/studies/README.md": "figures.md",
    "scripts/README.md": "scripts.md",
    "addon/README.md": "extension.md",
}
SECTIONS = {  # of the navigation
    "In Blender": ("manual/index.md", GALLERY),
    "Between programs": ("usd.md", "gltf.md", "shaders.md"),
    "Measured": ("figures.md",),
    "For developers": ("scripts.md", "extension.md"),
}
PICTURES = "pictures"
# What search shows of a page's text is fetched, which browsers forbid for files of the disk.
NO_SUMMARY = 'if (location.protocol === "file:") DOCUMENTATION_OPTIONS.SHOW_SEARCH_SUMMARY = false'
KINDS = {"Matte": "Matte", "Skin": "Skin", "Translucent": "Translucent materials"}  # of presets, in the menus' order
UNITS = {"Subsurface Radius": " mm"}
CODE = re.compile(r"(^```.*?^```)", re.DOTALL | re.MULTILINE)
LINK = re.compile(r"(!?)(\[[^\]]*\])\(([^)\s#]*)(#[^)\s]*)?\)")


def pages() -> dict[str, str]:
    """Return the path in the site of each Markdown page, by its path in the checkout."""
    manual = {path.name: path for path in sorted((ROOT / MANUAL).glob("*.md"))}
    names = {name: "index.md" if name == "README.md" else name for name in manual}
    return PAGES | {f"{MANUAL}/{name}": f"manual/{names[name]}" for name in manual}


def stage(folder: Path) -> None:
    """Write the pages' Markdown, with links as in the site, and their pictures into the empty `folder`.

    Raises LookupError for a link to what the site has not.
    """
    found = pages()
    copied: set[Path] = set()
    for source, target in found.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        path = folder / target
        path.parent.mkdir(exist_ok=True)
        path.write_text(_relinked(text, source, found, copied) + _navigation(target, found.values()), encoding="utf-8")
    from true_diffuse.addon.material.presets import PRESETS
    from true_diffuse.addon.material.presets import picture as preview
    from true_diffuse.addon.nodes import GROUPS

    copied |= {preview(key) for key in (*PRESETS, *(group.key for group in GROUPS))}
    (folder / PICTURES).mkdir()
    for picture in copied:
        shutil.copyfile(picture, folder / PICTURES / picture.name)
    cut_models(folder / PICTURES)
    (folder / GALLERY).write_text(gallery(), encoding="utf-8")


def _relinked(text: str, source: str, found: Mapping[str, str], pictures: set[Path]) -> str:
    """Return the page `source`, its links turned to `found` pages and to the pictures, which are added to `pictures`."""
    here = PurePosixPath(found[source]).parent

    def turn(match: re.Match[str]) -> str:
        shown, words, path, anchor = match[1], match[2], match[3], match[4] or ""
        if not path or "://" in path:
            return match[0]
        linked = ((ROOT / source).parent / path).resolve()
        name = linked.relative_to(ROOT, walk_up=True).as_posix()
        if name in found:
            target = PurePosixPath(found[name])
        elif linked.suffix in (".webp", ".png", ".svg") and linked.is_file():
            pictures.add(linked)
            target = PurePosixPath(PICTURES, linked.name)
        else:
            raise LookupError(f"{source} links to {path}, which the site has not")
        row = "{.row}" if shown and here.name and _is_row(linked) else ""
        return f"{shown}{words}({target.relative_to(here, walk_up=True)}{anchor}){row}"

    parts = CODE.split(text)
    parts[::2] = [LINK.sub(turn, part) for part in parts[::2]]
    return "".join(parts)


def _is_row(picture: Path) -> bool:
    """Return whether a picture is a row of several, too long for a phone."""
    from true_diffuse.addon.measure.render import openimageio

    spec = openimageio().ImageBuf(str(picture)).spec()
    return spec.width > 3 * spec.height


def _navigation(target: str, found: Iterable[str]) -> str:
    """Return what a page needs so that others stand below it in the navigation."""
    if target == "index.md":
        sections: Mapping[str, Iterable[str]] = SECTIONS
    elif target == "manual/index.md":
        from true_diffuse.addon.nodes import GROUPS

        groups = [f"{group.key}.md" for group in GROUPS]
        others = sorted({Path(path).name for path in found if path.startswith("manual/")} - {"index.md", *groups})
        sections = {"": (*groups, *others)}
    else:
        return ""
    trees = [
        "\n".join(["", "```{toctree}", ":hidden:", *([f":caption: {caption}"] if caption else []), "", *below, "```", ""])
        for caption, below in sections.items()
    ]
    return "".join(trees)


def cut_models(folder: Path) -> None:
    """Write the pictures of the models, MODEL_ID.png, into `folder`: the parts of the manual's strip, without captions."""
    from true_diffuse.addon.measure.render import openimageio
    from true_diffuse.addon.models import MODELS
    from true_diffuse.scripts.release.manual import SIZE

    oiio = openimageio()
    strip = oiio.ImageBuf(str(ROOT / MANUAL / "rough_diffuse_model.webp"))
    for index, model in enumerate(MODELS.values()):
        part = oiio.ImageBufAlgo.cut(strip, oiio.ROI(index * SIZE, (index + 1) * SIZE, 0, SIZE))
        part.write(str(folder / f"{model.id}.png"))


def gallery() -> str:
    """Return the page of all presets, models and nodes in Markdown."""
    from true_diffuse.addon.material.presets import PRESETS
    from true_diffuse.addon.models import MODELS
    from true_diffuse.addon.nodes import GROUPS

    lines = [
        "# Gallery",
        "",
        "Every material, reflectance model and node that comes with the extension. Materials are in Object > True Diffuse, in the",
        "panel's presets and in the asset library. Colors are linear Rec. 709, as in the sockets.",
        "",
    ]
    for kind, title in KINDS.items():
        lines += ["{.gallery}", f"## {title}", ""]
        for preset in PRESETS.values():
            if preset.kind == kind:
                lines += _entry(preset.name, f"{preset.key}.webp", f"{preset.description}.", _values(preset))
    lines += ["{.gallery}", "## Models", ""]
    for model in MODELS.values():
        lines += _entry(model.label, f"{model.id}.png", f"{model.description}.", [])
    lines += ["{.gallery}", "## Nodes", ""]
    for group in GROUPS:
        lines += _entry(group.label, f"{group.key}.webp", f"{group.description}.", [f"[All inputs](manual/{group.key}.md)"])
    return "\n".join(lines)


def _entry(name: str, picture: str, description: str, facts: list[str]) -> list[str]:
    return [f"### {name}", "", f"![{name}]({PICTURES}/{picture})", "", description, "", *(f"- {fact}" for fact in facts), ""]


def _values(preset: "Preset") -> list[str]:
    """Return the values of a preset's inputs, as lines."""
    facts = [f"Node: {preset.group.label}"]
    for name, value in preset.inputs.items():
        numbers = value[:3] if isinstance(value, tuple) else (value,)
        swatch = ""
        if name == "Color":
            color = " ".join(f"{number:.3f}" for number in numbers)
            swatch = f'<span class="swatch" style="background: color(srgb-linear {color})"></span>'
        facts.append(f"{name}: {swatch}{', '.join(f'{number:.3g}' for number in numbers)}{UNITS.get(name, '')}")
    return facts


def build(work: Path, folder: Path) -> None:
    """Write the site into the empty `folder`; `work` is a folder for what is needed meanwhile.

    Raises BadInput where Sphinx is not installed, or warns of a page.
    """
    application, failure, glsl = sphinx()
    source = work / "source"
    source.mkdir()
    stage(source)
    shutil.copyfile(ROOT / "addon/previews/rough_diffuse.webp", source / "logo.webp")
    static = work / "static"
    static.mkdir()
    shutil.copyfile(STYLE, static / STYLE.name)
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text(encoding="utf-8"))
    settings = {
        "project": manifest["name"],
        "version": manifest["version"],
        "release": manifest["version"],
        "project_copyright": manifest["copyright"][0],
        "extensions": ["myst_parser"],
        "myst_enable_extensions": ["attrs_block", "attrs_inline"],
        "myst_heading_anchors": 3,
        "html_theme": "furo",
        "html_title": f"{manifest['name']} {manifest['version']}",
        "html_logo": "logo.webp",
        "html_favicon": "logo.webp",
        "html_static_path": [str(static)],
        "html_css_files": [STYLE.name],
        "html_use_index": False,
        "html_copy_source": False,
        "html_show_sourcelink": False,
        "html_js_files": [(None, {"body": NO_SUMMARY})],
    }
    warnings = io.StringIO()
    try:
        made = application(source, None, folder, work / "trees", "html", settings, status=None, warning=warnings)
        made.add_lexer("gdshader", glsl)  # Godot's language is GLSL with a few words more
        made.build()
    except failure as error:
        raise BadInput(f"Sphinx: {error}") from error
    if warnings.getvalue():
        raise BadInput(f"Sphinx: {' '.join(warnings.getvalue().replace(f'{source}{os.sep}', '').split())}")


def sphinx() -> tuple[Callable, type[Exception], type]:
    """Return Sphinx's application, its error, and the lexer of GLSL. Raises BadInput where it is not installed."""
    try:
        import furo  # noqa: F401 - of one group, so it is said before any work
        import myst_parser  # noqa: F401
        from pygments.lexers.graphics import GLShaderLexer
        from sphinx.application import Sphinx
        from sphinx.errors import SphinxError
        from sphinx.util.console import nocolor
    except ImportError as error:
        raise BadInput(f"{error.name} is not installed: uv run --group site scripts/release/manual.py --site DIR") from error
    nocolor()  # in its warnings
    return Sphinx, SphinxError, GLShaderLexer
