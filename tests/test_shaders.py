# SPDX-License-Identifier: GPL-3.0-or-later
"""The shaders: GLSL on the driver against the formulas in 50 digits, OSL compiled and rendered by Cycles."""

import itertools
import json
import math
import random
import re
import subprocess
import sys
from functools import partial

import pytest

from support import USUAL, CountedProgress
from true_diffuse.addon import models
from true_diffuse.addon.blender.glsl import SHADERS, includes, source
from true_diffuse.addon.models.vector import dot, from_polar
from true_diffuse.scripts.studies import reference_mpmath, stability_glsl
from true_diffuse.scripts.studies.glsl_values import evaluate
from true_diffuse.scripts.studies.study import run

COUNT = 2000
NAMES = [shader.model for shader in stability_glsl.DRAWN]
PATHS = sorted(SHADERS.glob("*.glsl"))
NODE_PATHS = sorted(SHADERS.glob("nodes/*.glsl"))
STEMS = [path.stem for path in PATHS + NODE_PATHS]
every_file = pytest.mark.parametrize("path", PATHS + NODE_PATHS, ids=lambda path: path.stem)
VERSIONS = {"330 core": "", "300 es": "precision highp float;\n"}

# In a process of its own, as Blender aborts when its context is no longer the current one. Reads a list of functions and writes the
# compiler's complaints about each.
COMPILE = """
import json, sys
import moderngl
context = moderngl.create_context(standalone=True, backend="egl", libgl="libGL.so.1", libegl="libEGL.so.1")
complaints = []
for version, functions in json.load(sys.stdin):
    head = f"#version {version}\\n"
    try:
        context.program(
            vertex_shader=head + "void main() { gl_Position = vec4(0.0); }",
            fragment_shader=head + functions + "\\nout vec4 result;\\nvoid main() { result = vec4(1.0); }",
        )
        complaints.append("")
    except moderngl.Error as error:
        complaints.append(str(error))
print(json.dumps(complaints))
"""


@pytest.fixture(scope="module")
def records(eevee_runs_here: bool) -> list[dict]:
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    return list(run(stability_glsl.stability(reference_mpmath.radiance, quick, COUNT), CountedProgress()))


@pytest.fixture(scope="module")
def complaints(eevee_runs_here: bool) -> dict[tuple[str, str], str]:
    """What the driver's compiler says of each file in each version; one that uses fma, which neither has, is called "fma"."""
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    functions = {stem: source(stem) for stem in STEMS} | {"fma": "float f(float x) { return fma(x, x, x); }"}
    keys = list(itertools.product(VERSIONS, functions))
    sources = [(version, VERSIONS[version] + functions[stem]) for version, stem in keys]
    done = subprocess.run([sys.executable, "-c", COMPILE], input=json.dumps(sources), capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return dict(zip(keys, json.loads(done.stdout), strict=True))


@pytest.mark.render
@pytest.mark.parametrize("model", NAMES)
def test_glsl_is_as_near_its_formula_as_asked(model: str, records: list[dict]) -> None:
    for record in records:
        if record["model"] == model:
            # 2e-5 of the value, or where the input's own last bits move the value more than that, no more than they do
            assert record["outside"] == record["conditioned"], record
            assert record["share_within"] > 0.99  # the rest: both cosines below 1e-7 in a tilted frame, 0.5 % of the hardest family
            assert record["screen_error"] < 0.01  # what 64-bit floats add is nothing beside that


@pytest.mark.render
@pytest.mark.parametrize("model", NAMES)
def test_glsl_is_never_infinite_or_negative(model: str, records: list[dict]) -> None:
    assert all(record["finite"] for record in records if record["model"] == model)


@pytest.mark.render
@pytest.mark.parametrize("shader", stability_glsl.DRAWN, ids=NAMES)
def test_glsl_stays_finite_for_numbers_of_any_size(shader: stability_glsl.Shader, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    dice = random.Random(3)

    def size(low: float, high: float) -> float:
        return dice.choice((-1.0, 0.0, 1.0)) * 10.0 ** dice.uniform(low, high)

    # with N upwards and light and viewer mostly above it, so that not all is dark
    rows = [
        ((0.0, 0.0, 1.0, size(-44, 38)), *((size(-44, 9), size(-44, 1), abs(size(-19, 1)), size(-44, 38)) for _ in "lv"))
        for _ in range(20000)
    ]
    got = evaluate(shader.model, shader.call(), rows)
    assert all(0.0 <= value < math.inf for values in got for value in values)
    assert sum(values[0] > 0.0 for values in got) > 1000


@pytest.mark.render
@pytest.mark.parametrize("shader", stability_glsl.DRAWN, ids=NAMES)
def test_glsl_channels_have_their_own_albedo(shader: stability_glsl.Shader, eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("no graphics driver here")
    albedos = (0.25, 0.5, math.nan)  # exact in 32 bits
    n, l, v = (0.0, 0.0, 1.0), (0.6, 0.0, 0.8), (0.0, 0.28, 0.96)
    shape = tuple(parameter.typical for parameter in shader.parameters)
    rows = [stability_glsl.Inputs(n, l, v, albedo, shape).row() for albedo in albedos]
    gray = [value[0] for value in evaluate(shader.model, shader.call(), rows)]
    call = shader.call().replace("vec3(a.w)", "vec3(0.25, 0.5, a.w)")
    assert evaluate(shader.model, call, rows[2:])[0] == tuple(gray)


def test_every_glsl_file_is_compiled_and_every_model_measured() -> None:
    stems = {path.stem for path in PATHS}
    others = {
        "geometry",
        "lights",
        "directional_albedo",
        "coat",
        "burley",
        "ggx",
        "sheen",
    }
    assert stems == {*NAMES, *others}


@pytest.mark.render
@pytest.mark.parametrize("version", VERSIONS)
@pytest.mark.parametrize("stem", STEMS)
def test_glsl_compiles(stem: str, version: str, complaints: dict[tuple[str, str], str]) -> None:
    assert complaints[version, stem] == ""


@pytest.mark.render
@pytest.mark.parametrize("version", VERSIONS)
def test_glsl_compiler_refuses_what_the_version_lacks(version: str, complaints: dict[tuple[str, str], str]) -> None:
    assert "fma" in complaints[version, "fma"]


@every_file
def test_glsl_says_what_it_is(path) -> None:
    lines = path.read_text().splitlines()
    header = "\n".join(itertools.takewhile(lambda line: line.startswith("//"), lines))
    assert lines[0] == "// SPDX-License-Identifier: GPL-3.0-or-later"
    assert "GLSL 3.30 and ES 3.00 (under precision highp float); functions only, no bindings." in header
    # of the models, only these two need nothing
    assert includes(path.stem) or path.stem in ("geometry", "lights") or path in NODE_PATHS


@every_file
def test_glsl_has_functions_only(path) -> None:
    code = re.sub(r"//.*", "", path.read_text())
    assert not re.search(r"^\s*(#|uniform|layout|in|out|varying|attribute|precision)\b", code, re.MULTILINE)


REFEREED = {model.id: (model.shape(USUAL), model.reference(USUAL)) for model in models.MODELS.values()}
REFEREED["blinn_phong"] = (0.3, 50.0), models.Specular(0.3, 50.0)


@pytest.mark.parametrize("name", NAMES)
def test_reference_equals_the_model(name: str) -> None:
    shape, model = REFEREED[name]
    dice = random.Random(5)
    for _ in range(200):
        n, l, v = (0.0, 0.0, 1.0), from_polar(dice.random(), dice.uniform(0.0, 7.0)), from_polar(dice.random(), 0.0)
        # 2^-52 in the vectors' length, raised to the highlight's power of 50 or divided by a cosine of 1e-3
        assert model.radiance(n, l, v, 0.7) == pytest.approx(float(reference_mpmath.radiance(name, n, l, v, 0.7, shape)), rel=1e-12)


@pytest.mark.parametrize(("mu_i", "mu_o", "azimuth"), [(0.9, 0.4, 0.5), (0.3, 0.3, 2.0), (0.7, 0.95, 3.0)])
def test_reference_of_pits_equals_the_sum_over_the_wall(mu_i: float, mu_o: float, azimuth: float) -> None:
    n, l, v = (0.0, 0.0, 1.0), from_polar(mu_i, azimuth), from_polar(mu_o, 0.0)
    steps, once = 200, 0.0
    for i, j in itertools.product(range(steps), range(2 * steps)):
        m = from_polar((i + 0.5) / steps, math.pi * (j + 0.5) / steps)
        # the wall point that faces m is lit and seen if the ray from there passes the pit's opening
        if 2.0 * mu_i * dot(m, l) > m[2] and 2.0 * mu_o * dot(m, v) > m[2]:
            once += dot(m, l) * dot(m, v) * math.pi / steps**2
    rho = 0.8
    expected = rho / math.pi**2 * once / mu_o + rho**2 * mu_i / (math.pi * (4.0 - 2.0 * rho))
    # the triangle's sides cut about 800 of its 20,000 cells, which count whole or not at all: sqrt(800) / 2 / 20,000, four times
    assert float(reference_mpmath.radiance("pitted", n, l, v, rho)) == pytest.approx(expected, rel=3e-3)
