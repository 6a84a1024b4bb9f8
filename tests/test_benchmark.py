# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmark that Pick Settings for Error runs by itself: what it measures, what it keeps, and that settings follow from it."""

import json
import math
from pathlib import Path

import bpy

import pytest

from support import run_script
from test_probe import everything, sphere_error
from true_diffuse.addon.blender.engines import CYCLES, EEVEE, REALTIME, Engine
from true_diffuse.addon.closures.lobe import CYCLES as CYCLES_LOBES
from true_diffuse.addon.closures.lobes import Rendered
from true_diffuse.addon.material import materials
from true_diffuse.addon.material.summary import material_summary
from true_diffuse.addon.measure.record import Record, Step, advance
from true_diffuse.addon.models import OrenNayar
from true_diffuse.addon.nodes import PRINCIPLED, ROUGH_DIFFUSE, SPECULAR_GROUP, SUBSURFACE, Group
from true_diffuse.addon.operators import tolerance as tolerance_operator
from true_diffuse.addon.probe import benchmark
from true_diffuse.addon.probe.benchmark import Variant
from true_diffuse.addon.probe.measurement import RenderSetup
from true_diffuse.addon.probe.tolerance import choose

pytestmark = pytest.mark.usefixtures("registered")
LABEL = "Rough Diffuse, Balanced"
SIGMA = 0.35  # a multiple of the steps in which roughness is measured


@pytest.fixture(autouse=True)
def own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "user_folder", lambda: tmp_path)


def wanted(group: Group, engine: Engine, **inputs: materials.Setting) -> list[Variant]:
    bpy.context.scene.render.engine = engine.identifier
    summary = material_summary(materials.create("Material", group, **inputs))
    assert summary
    return benchmark.variants(summary, RenderSetup.of(bpy.context.scene))


def measured(variants: list[Variant]) -> list[Record]:
    steps, before, work = benchmark.steps(variants, RenderSetup.of(bpy.context.scene)), everything(), 0.0
    while isinstance(step := advance(steps), Step):
        assert everything() == before  # nothing is there between the steps
        work += step.work
    assert work == pytest.approx(benchmark.total_work(variants, RenderSetup.of(bpy.context.scene)))
    return step


def test_what_a_material_can_have_is_measured() -> None:
    def qualities(group: Group, engine: Engine, **inputs: materials.Setting) -> list[str | None]:
        return [variant.quality for variant in wanted(group, engine, **inputs)]

    assert qualities(ROUGH_DIFFUSE, EEVEE) == ["Fast", "Balanced", "Precise"]
    assert qualities(ROUGH_DIFFUSE, EEVEE, Quality="Exact for Chosen Lights")[-1] == "Exact for Chosen Lights"
    assert qualities(ROUGH_DIFFUSE, EEVEE, Model="Lambert") == ["Balanced"]  # which is one lobe, whatever the quality
    assert qualities(ROUGH_DIFFUSE, CYCLES) == ["Balanced"] and qualities(ROUGH_DIFFUSE, REALTIME) == [None]
    assert qualities(SUBSURFACE, CYCLES, Method="Christensen-Burley") == ["Christensen-Burley"]
    assert qualities(SUBSURFACE, EEVEE) == [None] and qualities(SPECULAR_GROUP, CYCLES) == []
    (variant,) = wanted(PRINCIPLED, CYCLES, **{"Model": "Fujii", "Diffuse Roughness": 0.31})
    assert variant == Variant("rough_diffuse", "Fujii", "Balanced", SIGMA, False)  # at a roughness not below its own


@pytest.mark.render
def test_settings_are_picked_without_a_report(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "COUNTS", (1, 4))
    bpy.ops.mesh.primitive_cube_add()
    scene, material = bpy.context.scene, materials.create("Clay", ROUGH_DIFFUSE, Roughness=SIGMA)
    bpy.context.object.data.materials.append(material)
    scene.render.engine, scene.true_diffuse.error = CYCLES.identifier, 2.0
    before = everything()
    assert bpy.ops.true_diffuse.pick_settings() == {"FINISHED"}
    assert everything()["data"] == before["data"]
    sphere, five = benchmark.read()
    # as in test_probe, but seen through other pixels
    assert sphere["floor"] == pytest.approx(sphere_error(Rendered(OrenNayar(SIGMA), CYCLES_LOBES), OrenNayar(SIGMA), 60.0), rel=0.1)
    error = math.hypot(sphere["floor"], five["points"][-1]["error"] * math.sqrt(4.0 / scene.cycles.samples))
    assert error <= 0.02 * 1.001 and scene.cycles.samples > 4
    assert tolerance_operator.picked[scene.session_uid].lines[0] == f"2 % expected with {scene.cycles.samples} samples"
    # what is kept is not measured again; another roughness is
    monkeypatch.setattr(benchmark, "steps", lambda missing, _: pytest.fail(f"measures {missing}"))
    scene.true_diffuse.error = 4.0
    assert bpy.ops.true_diffuse.pick_settings() == {"FINISHED"}
    setup = RenderSetup.of(scene)
    assert benchmark.missing(wanted(ROUGH_DIFFUSE, CYCLES, Roughness=0.31), setup, benchmark.read()) == []
    assert len(benchmark.missing(wanted(ROUGH_DIFFUSE, CYCLES, Roughness=0.3), setup, benchmark.read())) == 1
    assert benchmark.missing(wanted(ROUGH_DIFFUSE, CYCLES, Roughness=SIGMA), setup._replace(osl=True), benchmark.read()) == []
    assert benchmark.source().startswith("Measured on this machine, 20")
    benchmark.path().write_text("{")
    assert benchmark.read() == []


@pytest.mark.render
def test_benchmark_leaves_nothing_between_its_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(benchmark, "COUNTS", (1, 4, 16))
    monkeypatch.setattr(benchmark, "LONGEST", 0.0)  # a picture of 16 samples would take too long
    (curve,) = measured(wanted(SUBSURFACE, CYCLES))
    assert [point["samples"] for point in curve["points"]] == [1, 4] and curve["floor"] == 0.0
    # four independent samples have half the noise of one, to 10 % each; Cycles' are stratified, at best a fourth
    assert 1.6 <= curve["points"][0]["error"] / curve["points"][1]["error"] <= 4.0


@pytest.mark.slow
@pytest.mark.render
def test_choice_is_that_of_the_report(tmp_path: Path) -> None:
    """The noise of either is some 10 % uncertain, so the samples that follow from it are to (1.1 / 0.9)^2 = 1.5.

    The renders of the sphere are the same, so its errors are.
    """
    asked = "--quick --engine cycles --scene sphere,five --character monkey --out out"
    result = run_script("report.py", *asked.split(), cwd=tmp_path)
    assert result.returncode == 0, result.stderr
    report = json.loads((tmp_path / "out" / "report.json").read_text())
    bpy.context.scene.render.engine = CYCLES.identifier
    own = {"curves": measured([Variant("rough_diffuse", "Oren-Nayar", "Balanced", 0.33, False)])}
    case = {"scene": "five", "engine": "cycles", "model": "Oren-Nayar", "osl": False, "excluded": ("Exact for Chosen Lights",)}
    for tolerance in (0.08, 0.05, 0.03):
        theirs, ours = (choose(source, **case, tolerance=tolerance, roughness=0.33) for source in (report, own))
        assert theirs.quality == ours.quality
        assert 1.0 / 1.5 <= ours.samples / theirs.samples <= 1.5, (tolerance, theirs, ours)
    (floor,) = {curve["floor"] for curve in report["curves"] if (curve["scene"], curve["label"]) == ("sphere", LABEL)}
    assert own["curves"][0]["floor"] == pytest.approx(floor, rel=0.01)
