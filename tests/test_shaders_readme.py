# SPDX-License-Identifier: GPL-3.0-or-later
"""shaders/README.md: its files, the files they need, and its example, compiled and evaluated on the graphics driver."""

import random
import re

import pytest

from true_diffuse.addon.blender.glsl import SHADERS, includes
from true_diffuse.addon.models import OrenNayar, directional_albedo
from true_diffuse.addon.models.vector import from_polar
from true_diffuse.scripts.studies.glsl_values import evaluate_functions

README = (SHADERS / "README.md").read_text()
(EXAMPLE,) = re.findall(r"```glsl\n(.*?)```", README, re.DOTALL)
INCLUDED = {  # the last column of the table of files, by the first
    name: included.strip() for name, included in re.findall(r"^\| (\w+\.(?:glsl|osl)) \|.*\|(.*)\|$", README, re.MULTILINE)
}


def test_readme_lists_every_file() -> None:
    assert set(INCLUDED) == {path.name for path in SHADERS.iterdir() if path.suffix in {".glsl", ".osl"}}


@pytest.mark.parametrize("stem", [path.stem for path in SHADERS.glob("*.glsl")])
def test_readme_says_what_a_file_needs(stem: str) -> None:
    assert list(filter(None, INCLUDED[f"{stem}.glsl"].split(", "))) == includes(stem)


def test_readme_names_files_that_exist() -> None:
    paths = re.findall(r"\b(?:addon|scripts|tests)/[\w/]+(?:\.py)?|\brealtime/\w+\.glsl", README)
    assert [path for path in paths if not (SHADERS / path).exists() and not (SHADERS.parent / path).exists()] == []
    listed = {f"{stem}.glsl" for stem in re.findall(r"^\| (\w+) \| [a-z ]+\. ", README, re.MULTILINE)}
    assert listed == {path.name for path in (SHADERS / "realtime").iterdir()}


@pytest.mark.render
@pytest.mark.usefixtures("driver")
def test_readme_example_is_the_model() -> None:
    included = re.findall(r"(\w+\.glsl)", EXAMPLE.splitlines()[0])
    functions = "\n".join([*((SHADERS / name).read_text() for name in included), EXAMPLE])
    dice = random.Random(7)
    n = (0.0, 0.0, 1.0)
    # one light of the last rows is below the horizon
    directions = [tuple(from_polar(dice.uniform(low, 1.0), dice.uniform(0.0, 6.0)) for low in (0.1, 0.1, 0.1)) for _ in range(50)]
    directions += [(l, (*second[:2], -second[2]), v) for l, second, v in directions[:10]]
    irradiance, sky, albedo, sigma = ((3.0, 2.0, 1.0), (0.5, 1.0, 2.0)), (0.1, 0.2, 0.3), (0.8, 0.5, 0.2), 0.33
    call = (
        "shade_rough(vec3(0.0, 0.0, 1.0), c.xyz, vec3(0.8, 0.5, 0.2), 0.33, vec3[2](a.xyz, b.xyz), "
        "vec3[2](vec3(3.0, 2.0, 1.0), vec3(0.5, 1.0, 2.0)), vec3(0.1, 0.2, 0.3))"
    )
    model = OrenNayar(sigma)
    for (*lights, v), got in zip(directions, evaluate_functions(functions, call, directions), strict=True):
        expected = [
            sky[k] * directional_albedo(model, v[2], rho, 32)
            + sum(e[k] * model.radiance(n, l, v, rho) for e, l in zip(irradiance, lights, strict=True))
            for k, rho in enumerate(albedo)
        ]
        # 2e-5 of each radiance, as the README says, and the rounding of a sum of three
        assert got == pytest.approx(expected, rel=3e-5)
