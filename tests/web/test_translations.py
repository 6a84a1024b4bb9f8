# SPDX-License-Identifier: GPL-3.0-or-later
"""The WGSL and HLSL of the shaders as Chromium's WebGPU computes them, against the formulas in 50 digits.

HLSL gets there as SPIR-V, by Khronos' compiler, and from that as WGSL.
"""

import random
import re
import shutil
import subprocess
from collections.abc import Iterator, Sequence
from functools import partial
from pathlib import Path

import pytest

from support import CountedProgress
from true_diffuse.addon.blender.glsl import SHADERS, includes, source
from true_diffuse.addon.models import MODELS, OrenNayar, ReflectanceModel
from true_diffuse.addon.models.vector import from_polar
from true_diffuse.scripts.release import shaders
from true_diffuse.scripts.studies import reference_mpmath, stability_glsl
from true_diffuse.scripts.studies.glsl_values import evaluate_functions
from true_diffuse.scripts.studies.study import run
from true_diffuse.scripts.web import WebError
from true_diffuse.scripts.web.browser import Browser, Page

pytestmark = pytest.mark.web

COUNT = 2000
type Row = tuple[Sequence[float], ...]
WGSL = """
@group(0) @binding(0) var<storage, read> rows: array<vec4<f32>>;
@group(0) @binding(1) var<storage, read_write> values: array<vec4<f32>>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3<u32>) {
    if (id.x < arrayLength(&values)) {
        let a = rows[3 * id.x];
        let b = rows[3 * id.x + 1];
        let c = rows[3 * id.x + 2];
        values[id.x] = vec4(CALL, 1.0);
    }
}
"""
HLSL = """
StructuredBuffer<float4> rows : register(t0);
RWStructuredBuffer<float4> values : register(u1);
[numthreads(64, 1, 1)]
void main(uint3 id : SV_DispatchThreadID)
{
    uint count, stride;
    values.GetDimensions(count, stride);
    if (id.x < count) {
        float4 a = rows[3 * id.x];
        float4 b = rows[3 * id.x + 1];
        float4 c = rows[3 * id.x + 2];
        values[id.x] = float4(CALL, 1.0);
    }
}
"""
# Runs `code` for each three vec4s of `rows` and gives a vec4 for each. A warning of the compiler is an error.
COMPUTE = """async ([code, rows]) => {
  const device = await (await navigator.gpu.requestAdapter()).requestDevice()
  device.addEventListener("uncapturederror", (event) => console.error(event.error.message))
  const module = device.createShaderModule({ code })
  const { messages } = await module.getCompilationInfo()
  if (messages.length) throw Error(messages.map((one) => `${one.type} in line ${one.lineNum}: ${one.message}`).join("; "))
  const pipeline = await device.createComputePipelineAsync({ layout: "auto", compute: { module } })
  const given = new Float32Array(rows.length)
  rows.forEach((value, i) => (given[i] = Number(value)))
  const count = rows.length / 12
  const { STORAGE, COPY_DST, COPY_SRC, MAP_READ } = GPUBufferUsage
  const input = device.createBuffer({ size: given.byteLength, usage: STORAGE | COPY_DST })
  const output = device.createBuffer({ size: 16 * count, usage: STORAGE | COPY_SRC })
  const read = device.createBuffer({ size: 16 * count, usage: MAP_READ | COPY_DST })
  device.queue.writeBuffer(input, 0, given)
  const entries = [input, output].map((buffer, binding) => ({ binding, resource: { buffer } }))
  const encoder = device.createCommandEncoder()
  const pass = encoder.beginComputePass()
  pass.setPipeline(pipeline)
  pass.setBindGroup(0, device.createBindGroup({ layout: pipeline.getBindGroupLayout(0), entries }))
  pass.dispatchWorkgroups(Math.ceil(count / 64))
  pass.end()
  encoder.copyBufferToBuffer(output, 0, read, 0, 16 * count)
  device.queue.submit([encoder.finish()])
  await read.mapAsync(GPUMapMode.READ)
  const { base64 } = await import("/web/pixels.js")
  return base64(new Float32Array(read.getMappedRange()))
}"""


@pytest.fixture(scope="module")
def page(browser: Browser) -> Iterator[Page]:
    with browser.page({"": "", "web": Path(stability_glsl.__file__).parents[1] / "web"}) as made:
        made.open("/")
        yield made


def compute(page: Page, language: str, functions: str, call: str, rows: Sequence[Row], folder: Path) -> list[tuple[float, ...]]:
    """What `evaluate_functions` of glsl_values.py does, with `functions` and `call` in a language."""
    code = functions + {"wgsl": WGSL, "hlsl": HLSL}[language].replace("CALL", call)
    if language == "hlsl":
        code = from_hlsl(code, folder)
    # JSON has neither infinity nor NaN
    numbers = [str(x).replace("inf", "Infinity") for row in rows for vector in row for x in (*vector, 0.0)[:4]]
    values = page.floats(COMPUTE, [code, numbers])
    return [tuple(values[i : i + 3]) for i in range(0, len(values), 4)]


def from_hlsl(code: str, folder: Path) -> str:
    """A compute shader in WGSL, by way of SPIR-V."""
    if shutil.which("glslangValidator") is None:
        pytest.skip("glslangValidator is not installed, Khronos' compiler of HLSL")
    hlsl, binary, wgsl = (folder / f"shader.{kind}" for kind in ("hlsl", "spv", "wgsl"))
    hlsl.write_text(code)
    subprocess.run(
        ["glslangValidator", "-D", "-V", "-S", "comp", "-e", "main", "-o", binary, hlsl], check=True, capture_output=True
    )
    subprocess.run(["naga", binary, wgsl], check=True, capture_output=True)
    return wgsl.read_text()


@pytest.mark.parametrize("language", shaders.LANGUAGES)
def test_translation_is_as_near_its_formula_as_the_glsl(
    language: str, translations: dict[str, dict[str, str]], page: Page, tmp_path: Path
) -> None:
    def translated(stem: str, call: str, rows: Sequence[Row]) -> list[tuple[float, ...]]:
        functions = "\n".join(translations[language][name] for name in (*includes(stem), stem))
        return compute(page, language, functions, call.replace("vec3(a.w)", "a.www"), rows, tmp_path)

    quick = partial(reference_mpmath.radiance, context=reference_mpmath.DOUBLE)
    steps = stability_glsl.stability(reference_mpmath.radiance, quick, COUNT, language, translated)
    records = list(run(steps, CountedProgress()))
    assert {record["model"] for record in records} == {shader.model for shader in stability_glsl.DRAWN}
    for record in records:
        # as test_shaders.py has it of the GLSL
        assert record["outside"] == record["conditioned"], record
        assert record["share_within"] > 0.99
        assert record["finite"]


def albedo(model: ReflectanceModel) -> str:
    """The ambient term for the inputs of `test_rest_is_as_the_glsl`."""
    coefficients = f", {model.id}_coefficients(b.w)" if model.parameter else ""
    return f"{model.id}_albedo(a.x, b.xyz{coefficients})"


# Beside the models' radiance; functions that have no names of their own in a translation
CALLS = [
    *map(albedo, MODELS.values()),
    "blinn_phong_albedo(a.x, b.xyz, a.y, 50.0 * b.w)",
    "vec3(coat_highlight(coat_surface(c.xyz, b.xyz, a.y), b.zxy), coat_fresnel(a.x, a.y, 1.0 + a.z), coat_alpha(a.y))",
    "vec3(ggx_dielectric(a.x, 1.1 + a.y), ggx_dielectric_mean(1.1 + a.y), ggx_grazing(a.x, 1.1 + a.y))",
    "ggx_multiple(b.xyz, a.x, a.y)",
    "vec3(sheen_radiance(sheen_lobe(c.xyz, b.xyz, a.y), b.zxy), sheen_albedo(a.x, 0.01 + 0.9 * a.y), 0.0)",
    "burley_profile(a.x, b.xyz)",
    "burley_d(b.xyz, c.xyz)",
    "vec3(burley_radius(a.x, b.x), burley_radius(a.y, b.y), burley_radius(0.001 * a.z, b.z))",
]


@pytest.mark.usefixtures("driver")
@pytest.mark.parametrize("language", shaders.LANGUAGES)
@pytest.mark.parametrize("call", CALLS)
def test_rest_is_as_the_glsl(call: str, language: str, translations: dict[str, dict[str, str]], page: Page, tmp_path: Path) -> None:
    dice = random.Random(4)
    vectors = [tuple(dice.uniform(0.05, 0.95) for _ in range(4)) for _ in range(400)]
    rows = [(a, b, (0.0, 0.6, 0.8, 0.0)) for a, b in zip(vectors[::2], vectors[1::2], strict=True)]
    functions = "\n".join(translations[language].values())
    values = compute(page, language, functions, call.replace("vec3(", "float3(") if language == "hlsl" else call, rows, tmp_path)
    expected = evaluate_functions(source(*shaders.stems()), call, rows)
    assert len({value for row in expected for value in row}) > 100
    for value, other in zip(values, expected, strict=True):
        # Both drivers may be off by the last bits of exp, log and pow, which make 1e-6, and differences of such numbers more
        assert value == pytest.approx(other, rel=2e-5, abs=1e-6)


def example(engine: str, hlsl: dict[str, str]) -> str:
    """The HLSL of shaders/README.md for an engine, which calls the function `shade` here."""
    (block,) = re.findall(rf"### {engine}\n.*?```hlsl\n(.*?)```", (SHADERS / "README.md").read_text(), re.DOTALL)
    parameters = "float3 Normal, float3 View, float3 Light, float3 Albedo, float Sigma, float3 Irradiance"
    if engine == "Unity":
        body = "float3 Radiance;\nOrenNayar_float(Normal, View, Light, Albedo, Sigma, Irradiance, Radiance);\nreturn Radiance;\n"
        functions = re.sub(r'#include "hlsl/(\w+)\.hlsl"', lambda match: hlsl[match[1]], block)
    else:
        body, functions = block, hlsl["geometry"] + hlsl["oren_nayar"]
    return f"{functions}\nfloat3 shade({parameters})\n{{\n{body}}}\n"


@pytest.mark.parametrize("engine", ["Unity", "Unreal"])
def test_readme_s_hlsl_is_equation_1(engine: str, translations: dict[str, dict[str, str]], page: Page, tmp_path: Path) -> None:
    dice, model, n = random.Random(3), OrenNayar(0.33), (0.0, 0.0, 1.0)
    rows = [tuple(from_polar(dice.uniform(0.1, 1.0), dice.uniform(0.0, 6.0)) for _ in range(3)) for _ in range(50)]
    call = "shade(float3(0.0, 0.0, 1.0), b.xyz, a.xyz, float3(0.8, 0.5, 0.2), 0.33, float3(3.0, 2.0, 1.0))"
    values = compute(page, "hlsl", example(engine, translations["hlsl"]), call, rows, tmp_path)
    for (l, v, _), value in zip(rows, values, strict=True):
        # 2e-5, as the README says
        assert value == pytest.approx(
            [e * model.radiance(n, l, v, rho) for e, rho in ((3.0, 0.8), (2.0, 0.5), (1.0, 0.2))], rel=2e-5
        )


def test_compiler_s_complaint_is_one_line(page: Page) -> None:
    with pytest.raises(WebError, match="10:29 error: unresolved value 'lost'"):
        page.call(COMPUTE, [WGSL.replace("CALL", "lost"), []])
