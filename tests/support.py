# SPDX-License-Identifier: GPL-3.0-or-later
"""What several test files need: the registered reflectance models with usual inputs."""

import pytest

from true_diffuse.addon.models import MODELS, Formula

USUAL = {"Roughness": 0.5, "IOR": 1.5}
"""Inputs of a node group by socket, which every model makes use of."""
EXTREME = {"Roughness": 1.0, "IOR": 3.0}
every_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def formulas() -> list[Formula]:
    """Every registered formula, with usual and with extreme inputs."""
    return [model.reference(inputs) for model in MODELS.values() for inputs in (USUAL, EXTREME)]
