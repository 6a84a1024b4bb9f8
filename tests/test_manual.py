# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's pages match the groups and have a picture of every socket; what the site is made of (tests/web/test_site.py)."""

import re
import subprocess
import sys
from pathlib import Path

import bpy

import pytest
from bl_operators.wm import WM_OT_doc_view_manual

from true_diffuse.addon.blender.id_properties import GROUP_ID
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.measure.render import openimageio
from true_diffuse.addon.models import MODELS
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, Group
from true_diffuse.addon.ui import online_manual
from true_diffuse.scripts.cli.console import BadInput
from true_diffuse.scripts.cli.outputs import OutputFolder
from true_diffuse.scripts.release import manual, website
from true_diffuse.scripts.studies import pictures

pytestmark = pytest.mark.usefixtures("empty_file")


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_page_is_what_the_group_is_now(group: Group) -> None:
    assert (manual.PAGES / f"{group.key}.md").read_text(encoding="utf-8") == manual.page(group)


@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_page_has_every_socket_and_its_picture(group: Group) -> None:
    page = (manual.PAGES / f"{group.key}.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.*)$", page, re.MULTILINE) == [socket.name for socket in group.inputs]
    names = re.findall(r"\]\((.*?\.webp)\)", page)
    shown = [socket.name for socket in group.inputs if manual.has_picture(group, socket)]
    assert names == [manual.picture_name(group, socket) for socket in group.inputs if socket.name in shown]
    own = ["Model", "Quality", "Diffuse Roughness"]  # what the Principled BSDF lacks; the normal has none elsewhere
    assert shown == (own if group is PRINCIPLED else [socket.name for socket in group.inputs if socket.name != "Normal"])
    assert all((manual.PAGES / name).is_file() for name in names)


def test_strip_puts_pictures_side_by_side_above_their_captions(tmp_path: Path) -> None:
    oiio = openimageio()
    parts = []
    for name, color in (("red", (1.0, 0.0, 0.0)), ("blue", (0.0, 0.0, 1.0))):
        flat = oiio.ImageBuf(oiio.ImageSpec(32, 24, 3, "uint8"))
        oiio.ImageBufAlgo.fill(flat, color)
        parts.append(tmp_path / f"{name}.png")
        flat.write(str(parts[-1]))
    pictures.strip(parts, tmp_path / "both.webp", ["a", "b"])
    both = oiio.ImageBuf(str(tmp_path / "both.webp"))
    assert both.spec().width == 64 and both.spec().height > 24
    for x, color in ((16, (1.0, 0.0, 0.0)), (48, (0.0, 0.0, 1.0))):
        assert both.getpixel(x, 12)[:3] == pytest.approx(color, abs=0.05)  # WebP loses a little


@pytest.fixture(scope="module")
def staged(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    website.stage(folder)
    return folder


def test_every_page_of_the_checkout_is_in_the_site(staged: Path) -> None:
    folders = ("addon", "shaders", "scenes", "scripts")
    written = {
        "README.md",
        *(str(path.relative_to(website.ROOT)) for name in folders for path in (website.ROOT / name).rglob("*.md")),
    }
    assert set(website.pages()) == written
    pages = {str(path.relative_to(staged)) for path in staged.rglob("*.md")}
    assert pages == {*website.pages().values(), "gallery.md"}
    listed = re.findall(r"^([\w/]+\.md)$", (staged / "index.md").read_text(), re.MULTILINE)
    listed += [f"manual/{name}" for name in re.findall(r"^(\w+\.md)$", (staged / "manual" / "index.md").read_text(), re.MULTILINE)]
    assert sorted(listed) == sorted(pages - {"index.md"})  # each stands once in the navigation


def anchors(page: Path) -> set[str]:
    """The anchors of a page's headings, as GitHub and MyST make them: in lower case, spaces as hyphens, without punctuation."""
    text = re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL | re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in re.findall(r"^#+ (.*)$", text, re.MULTILINE)}


def test_links_and_pictures_of_the_site_are_there(staged: Path) -> None:
    links = 0
    for page in staged.rglob("*.md"):
        for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                path, _, anchor = target.partition("#")
                linked = page.parent / path if path else page
                assert linked.is_file(), (page.name, target)
                assert not anchor or anchor in anchors(linked), (page.name, target)
                links += 1
    assert links > len(PRESETS) + len(MODELS) + len(GROUPS)


def test_link_to_what_the_site_has_not_is_noticed() -> None:
    for link in ("[x](nowhere.md)", "![x](nowhere.png)", "[x](pyproject.toml)"):
        with pytest.raises(LookupError, match="which the site has not"):
            website._relinked(link, "README.md", website.pages(), set())


def test_gallery_shows_every_preset_model_and_node(staged: Path) -> None:
    page = (staged / "gallery.md").read_text(encoding="utf-8")
    titles = re.findall(r"^### (.*)\n\n!\[\1\]\((.*)\)$", page, re.MULTILINE)
    assert sorted(name for name, _ in titles) == sorted(
        item.label if hasattr(item, "label") else item.name for item in (*PRESETS.values(), *MODELS.values(), *GROUPS)
    )
    for preset in PRESETS.values():
        assert (staged / dict(titles)[preset.name]).read_bytes() == preset.picture.read_bytes()
        entry = page.partition(f"### {preset.name}\n")[2].partition("\n### ")[0]
        assert preset.description in entry and all(f"- {name}: " in entry for name in preset.inputs)
    assert re.search(r"### Chalk\n.*?- Color: <span.*?></span>0\.86, 0\.85, 0\.82\n- Roughness: 0\.4\n", page, re.DOTALL)
    assert "- Subsurface Radius: 8.37, 4.26, 2.09 mm\n" in page  # Chicken 1


def test_model_s_picture_is_its_part_of_the_strip(staged: Path) -> None:
    oiio = openimageio()
    strip = oiio.ImageBuf(str(manual.PAGES / "rough_diffuse_model.webp"))
    assert strip.spec().width == len(MODELS) * manual.SIZE
    for index, model in enumerate(MODELS.values()):
        picture = oiio.ImageBuf(str(staged / "pictures" / f"{model.id}.png"))
        assert (picture.spec().width, picture.spec().height) == (manual.SIZE, manual.SIZE)
        for x, y in ((3, 5), (88, 80), (170, 170)):
            assert picture.getpixel(x, y) == strip.getpixel(index * manual.SIZE + x, y)


def test_site_without_its_packages_is_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "furo", None)
    with pytest.raises(BadInput, match="furo is not installed: uv run --group site"):
        website.sphinx()


def test_site_takes_no_options_of_the_pictures(tmp_path: Path) -> None:
    command = [sys.executable, website.ROOT / "scripts/release/manual.py", "--site", tmp_path / "site", "--samples", "8"]
    result = subprocess.run(command, capture_output=True, text=True, check=False)
    assert result.returncode == 2 and result.stderr.count("\n") == 1 and not list(tmp_path.iterdir())


def test_output_s_folders_are_published(tmp_path: Path) -> None:
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "a.txt").write_text("before")
    (tmp_path / "taken").write_text("a file")
    with OutputFolder(tmp_path) as output:
        for name in ("old", "new"):
            (output.folder / name).mkdir()
            output.write_text(f"{name}/a.txt", "after")
        assert output.publish() == ["new/a.txt", "old/a.txt"]
        assert all((tmp_path / name / "a.txt").read_text() == "after" for name in ("old", "new"))
        (output.folder / "taken").mkdir()
        output.write_text("taken/a.txt", "after")
        with pytest.raises(BadInput, match="cannot write"):
            output.publish()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["new", "old", "taken"]


@pytest.fixture
def online(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    request.getfixturevalue("registered")
    monkeypatch.setattr(online_manual, "website", lambda: "https://studio.test/docs")


def asked(what: str) -> str | None:
    """The address that Online Manual opens for an identifier of Blender's."""
    return WM_OT_doc_view_manual._lookup_rna_url(what, verbose=False)


@pytest.mark.usefixtures("online")
@pytest.mark.parametrize(
    ("what", "page"),
    [
        ("bpy.ops.true_diffuse.convert", "manual/index.html"),
        ("bpy.ops.true_diffuse.assign_preset", "gallery.html"),
        ("bpy.ops.true_diffuse.use_selected_lights", "manual/index.html#chosen-lights-and-shadows"),
        ("bpy.types.TrueDiffuseScene.error", "manual/index.html"),
    ],
)
def test_online_manual_leads_from_operators_and_settings_to_the_site(what: str, page: str) -> None:
    assert asked(what) == f"https://studio.test/docs/{page}"


@pytest.mark.usefixtures("online")
@pytest.mark.parametrize("group", GROUPS, ids=lambda group: group.key)
def test_online_manual_leads_from_our_nodes_to_their_pages_alone(group: Group) -> None:
    tree = bpy.data.materials.new("Chalk").node_tree
    ours, other = tree.nodes.new("ShaderNodeGroup"), tree.nodes.new("ShaderNodeGroup")
    ours.node_tree, other.node_tree = (bpy.data.node_groups.new(name, "ShaderNodeTree") for name in (group.name, "Other"))
    ours.node_tree[GROUP_ID] = group.identifier  # of the built group, which would take a second
    with bpy.context.temp_override(active_node=ours):
        assert asked("bpy.types.ShaderNodeGroup") == f"https://studio.test/docs/manual/{group.key}.html"
        assert "studio" not in (asked("bpy.types.ShaderNodeMath") or "")
    with bpy.context.temp_override(active_node=other):
        assert "studio" not in (asked("bpy.types.ShaderNodeGroup") or "")


@pytest.mark.usefixtures("registered")
def test_online_manual_has_no_page_of_ours_without_a_site() -> None:
    assert asked("bpy.ops.true_diffuse.convert") is None


def test_online_manual_s_pages_are_in_the_site(staged: Path) -> None:
    for _, target in online_manual.PAGES:
        page, _, anchor = target.partition("#")
        path = staged / page.replace(".html", ".md")
        assert path.is_file() and (not anchor or anchor in anchors(path))
