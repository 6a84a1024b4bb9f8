# SPDX-License-Identifier: GPL-3.0-or-later
"""What is timed beside Realtime shows the same picture."""

from contextlib import ExitStack
from pathlib import Path

import gpu
import pytest

from true_diffuse.scripts.characters import character
from true_diffuse.scripts.studies import competitors
from true_diffuse.scripts.studies.competitors import THREE, Crowd, Realtime, Setting

pytestmark = [pytest.mark.web, pytest.mark.render]

SIZE = (96, 54)
LOOKS = (1, 3)  # of five, from the left: Lambert and sigma 0, whose color the file has. It has others' that of the nearest EON
NEAR = 1e-3  # of radiances up to 1 under four suns, as the exporter rounds normals to four digits


@pytest.fixture
def crowd(request: pytest.FixtureRequest) -> Crowd:
    for needed in ("exporter", "driver"):
        request.getfixturevalue(needed)
    gpu.init()
    made = Crowd(character.load("human"), SIZE)
    made.arrange(Setting(4, 5))
    return made


@pytest.mark.usefixtures("node_modules")
def test_three_draws_the_picture_of_realtime(browser, crowd: Crowd, tmp_path: Path) -> None:
    with ExitStack() as stack:
        three = competitors.Three(browser, stack.enter_context(browser.page(competitors.files(tmp_path))))
        crowd.export(tmp_path / "crowd.glb")
        three.load(crowd, tmp_path / "crowd.glb")
        theirs = three.pixels(THREE["three.js, setReflectance"])
    drawn = Realtime(crowd)
    drawn.frame()
    own = drawn.pixels()
    columns = [x for x in range(SIZE[0]) if LOOKS[0] * SIZE[0] <= 5 * x < LOOKS[1] * SIZE[0]]
    pixels = [4 * (y * SIZE[0] + x) for y in range(SIZE[1]) for x in columns]
    differences = sorted(abs(own[index + channel] - theirs[index + channel]) for index in pixels for channel in range(3))
    assert max(own[index] for index in pixels) > 0.2
    assert differences[len(differences) * 9 // 10] < NEAR  # the others lie along edges
