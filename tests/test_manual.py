# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual's pages match the groups and have a picture of every socket."""

import re
from pathlib import Path

import pytest

from true_diffuse.addon.measure.render import openimageio
from true_diffuse.addon.nodes import GROUPS, PRINCIPLED, Group
from true_diffuse.scripts.release import manual
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
    own = ["Model", "Diffuse Roughness", "Quality"]  # what the Principled BSDF lacks; the normal has none elsewhere
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
