# SPDX-License-Identifier: GPL-3.0-or-later
"""Keyframed sigma, albedo and lights: frames equal the stills of their values at every quality; noise does not flicker."""

from dataclasses import astuple

import pytest

from true_diffuse.addon.blender.engines import REALTIME
from true_diffuse.scripts.studies import animation

# Blender works keys and drivers out in 32-bit floats, the stills' values come from 64-bit ones; the render itself is the same.
# EEVEE adds light up in 16-bit floats, of which a value at the edge between two may get the other: a step of 2^-10.
ROUNDING = {"cycles": 1e-5, "eevee": 2.0**-10, "realtime": 1e-5}


def test_values_go_linearly_from_start_to_end() -> None:
    middle = animation.values_at(animation.SLOW // 2, animation.SLOW - 1)
    assert astuple(animation.values_at(1)) == astuple(animation.START)
    assert astuple(animation.values_at(animation.LENGTH)) == pytest.approx(astuple(animation.END))
    halves = [(a + b) / 2.0 for a, b in zip(astuple(animation.START), astuple(animation.END), strict=True)]
    assert astuple(middle) == pytest.approx(halves)


@pytest.mark.render
@pytest.mark.parametrize(
    "quality",
    ["Balanced", "Exact for Chosen Lights", *(pytest.param(quality, marks=pytest.mark.slow) for quality in ("Fast", "Precise"))],
)
def test_keyed_frames_are_the_stills_of_their_values(quality: str, engine) -> None:
    if engine.key == "cycles" and quality in ("Fast", "Precise"):
        pytest.skip("Cycles renders it as Balanced")
    assert animation.keyed_difference(quality, engine, samples=2, size=24, frames=(8, animation.LENGTH)) < ROUNDING[engine.key]


@pytest.mark.render
@pytest.mark.usefixtures("registered")
def test_keyed_frames_of_realtime_are_the_stills_of_their_values(eevee_runs_here: bool) -> None:
    if not eevee_runs_here:
        pytest.skip("Realtime finds no graphics driver here")
    assert animation.keyed_difference("Balanced", REALTIME, samples=2, size=24, frames=(8, animation.LENGTH)) < ROUNDING["realtime"]


@pytest.mark.slow
@pytest.mark.render
def test_noise_does_not_flicker(engine) -> None:
    flicker = animation.flicker("Balanced", engine, samples=4, size=32)
    assert flicker.noise > 2e-3  # there is some, beyond EEVEE's rounding
    assert flicker.still == 0.0  # the same random numbers in every frame
    assert 0.0 < flicker.moving < flicker.noise
