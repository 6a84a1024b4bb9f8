# SPDX-License-Identifier: GPL-3.0-or-later
"""The timing of frames: what is timed draws the same picture and is interleaved. No times."""

import pytest

from support import CountedProgress
from true_diffuse.scripts.studies import competitors, first_picture, frame_time
from true_diffuse.scripts.studies.frame_time import LAMBERT, OREN_NAYAR, PLAIN, PLAIN_LAMBERT, VARIANTS, Setting
from true_diffuse.scripts.studies.study import run

ROUND = 4e-6  # of radiances up to 1, after some ten operations in 32 bits on either side
SIZE = (64, 36)


class Counted:
    """A drawing whose frames take what a formula says."""

    def __init__(self) -> None:
        self.order: list[str] = []
        self.names = {id(law): name for name, law in VARIANTS.items()}

    def prepare(self, setting: Setting) -> dict[str, int]:
        self.setting = setting
        return {"width": round(1000 * setting.pixels), "height": 1000, "triangles": round(1e6 * setting.triangles)}

    def frame(self, law) -> dict[str, float]:
        name = self.names[id(law)]
        self.order.append(name)
        rough = 0.5 if name == OREN_NAYAR else 0.25
        seconds = 1.0 + rough * self.setting.lights * self.setting.pixels + 2.0 * self.setting.triangles
        return {"readback": seconds, "processor": 2.0 * seconds}


def test_variants_are_interleaved_in_either_order() -> None:
    drawing = Counted()
    frame_time.compare(drawing, Setting(1), VARIANTS, 3)
    names = list(VARIANTS)
    assert drawing.order == names + names + names[::-1] + names  # the first for the compiler


@pytest.fixture(scope="module")
def timed() -> list[dict]:
    """The records of a drawing whose frames take what a formula says."""
    return list(run(frame_time.steps(Counted(), False), CountedProgress()))


def test_ratio_is_that_of_the_times(timed) -> None:
    ratios = [r["over_lambert"] for r in timed if r["model"] == OREN_NAYAR and r.get("lit_by") == "8 suns"]
    assert ratios == pytest.approx([(3.0 + 0.5 * 8) / (3.0 + 0.25 * 8)] * 2)  # by both clocks


@pytest.mark.parametrize(
    ("what", "line"),
    [
        ("lights", (3.0, 0.5, 0.0)),
        ("pixels", (3.0, 2.0, 0.0)),  # by the million, under 4 lights
        ("triangles", (3.0, 2.0, 0.0)),
    ],
)
def test_growth_is_the_line_of_the_times(timed, what: str, line: tuple[float, ...]) -> None:
    (grown,) = [r for r in timed if r.get("grows_with") == what and r["model"] == OREN_NAYAR and r["clock"] == "readback"]
    assert (grown["start"], grown["slope"], grown["off"]) == pytest.approx(line)


@pytest.mark.parametrize("absolute", [False, True])
def test_table_has_milliseconds_where_they_mean_something(timed, absolute: bool) -> None:
    columns, rows = frame_time.table(timed, "readback", absolute)
    assert columns == ("Model", "1 sun", "2 suns", "4 suns", "8 suns", frame_time.AS_BUILT)
    assert [row[0] for row in rows] == list(VARIANTS)
    assert all(("ms" in cell) is absolute for row in rows for cell in row[1:] if cell != "-")


@pytest.mark.parametrize(
    ("name", "software"),
    [("llvmpipe (LLVM 15.0.6, 256 bits)", True), ("NVIDIA H200/PCIe/SSE2", False), ("AMD Radeon RX 7900 XTX", False)],
)
def test_software_is_told_from_hardware(name: str, software: bool) -> None:
    assert frame_time.is_software(name) is software


@pytest.mark.render
@pytest.mark.usefixtures("empty_file")
def test_characters_are_drawn_alike_by_all_forms(eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("Realtime finds no graphics driver here")
    from true_diffuse.scripts.characters import character

    characters = frame_time.Characters(character.load("monkey"), SIZE)
    sizes = {detail: characters.prepare(Setting(2, triangles=detail))["triangles"] for detail in frame_time.TRIANGLES}
    # quads are cut into eight triangles of two, and what few triangles there are into six
    assert sizes[4.0] == pytest.approx(4 * sizes[1.0], rel=0.05)
    assert sizes[0.25] == pytest.approx(sizes[1.0] / 4, rel=0.05)

    def picture(name: str) -> list[float]:
        characters.frame(VARIANTS[name])
        return list(characters.pixels())

    characters.prepare(Setting(2))
    rough, lambert = picture(OREN_NAYAR), picture(LAMBERT)
    assert max(abs(a - b) for a, b in zip(rough, lambert, strict=True)) > 0.05
    assert picture(PLAIN_LAMBERT) == pytest.approx(lambert, abs=ROUND)
    for name in PLAIN[1:]:
        assert picture(name) == pytest.approx(rough, abs=ROUND), name
    assert set(characters.frame(VARIANTS[LAMBERT])) == {"readback", "processor"}


def test_table_of_competitors_has_each_beside_realtime() -> None:
    about = {"clock": "processor", "lights": 4, "characters": 25, "shadows": True}
    times = {competitors.REALTIME: 0.1, competitors.DIFFUSE: 0.5}
    found = [{**about, "target": name, "seconds": time, "over_realtime": time / 0.1} for name, time in times.items()]
    found.append({**found[1], "clock": "readback", "seconds": 9.0})  # which is not shown
    columns, rows = competitors.table(found)
    assert columns == ("Suns", "Characters", *times)
    assert rows == [("4, shadows", "25", "100", "500 (5)")]


def test_table_of_first_pictures_has_their_parts() -> None:
    parts = {"reading": 0.1, "sending": 0.02, "drawing": 0.3, "compiling": 0.04}
    about = {"characters": 5, "triangles": 572_000, **parts}
    found = [
        {**about, "meshes": "own", "redraws": 2, "completing": 0.2},
        {**about, "meshes": "one", "redraws": 0, "completing": 0.0},
        {"loading": 0.05},
    ]
    columns, rows = first_picture.table(found)
    assert rows == [
        ("5, own", "572 000", "100", "20", "300", "40", "200 in 2"),
        ("5, one", "572 000", "100", "20", "300", "40", "-"),
        ("modules, once", "-", "50", "-", "-", "-", "-"),
    ]
    assert len(columns) == len(rows[0])
