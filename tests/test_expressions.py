# SPDX-License-Identifier: GPL-3.0-or-later
"""Expressions and their operations: GLSL and simplification against the Python reference, which test_read_nodes.py holds to Cycles."""

import itertools
import math
import random
import struct
import subprocess
import sys
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from true_diffuse.addon.blender.glsl import source
from true_diffuse.addon.material.expression import (
    Apply,
    Attribute,
    Constant,
    Curve,
    Expression,
    apply,
    as_kind,
    compute,
    curve,
    evaluate,
    triple,
    walk,
)
from true_diffuse.addon.material.node_formulas import TABLE_TOLERANCE, table
from true_diffuse.addon.material.operations import OPERATIONS, Value

ROWS = 400
# Of the larger of 1 and the value: 32-bit floats through a few operations, of which drivers' logarithms and powers lose most.
TOLERANCE = 1e-4
# The names of arguments that are numbers, not triples, of operations of one kind: the others take triples
SCALARS = {"combine": (0, 1, 2), "refract": (2,), "rotate_about": (2,), "fresnel": (0, 1)}
SCALARS |= dict.fromkeys(("mix_hue", "mix_saturation", "mix_value", "mix_color"), (2,))
# Where a step's place depends on the last bit of a quotient, drivers and Python may differ; arguments there are kept off the steps
STEPS = {"modulo", "floored_modulo", "wrap", "snap", "ping_pong"}


def count(operation: str) -> int:
    """How many arguments an operation takes, as its GLSL has them."""
    return 1 + max(int(index) for index in "0123" if f"{{{index}}}" in OPERATIONS[operation].glsl)
