# SPDX-License-Identifier: GPL-3.0-or-later
"""The table of lobes, lobe_table.json, which scripts/fit/lobes.py writes: by lobe set and family, the lobes and their weights."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from .lobe import Fit, Lobe, Weight


def to_json(table: Mapping[str, Mapping[str, Fit]]) -> dict[str, Any]:
    """Return `table` as JSON holds it, numbers with five digits: enough for 1e-5 of a lobe."""

    def rounded(rows: tuple[tuple[float, ...], ...]) -> list[list[float]]:
        return [[float(f"{value:.5g}") for value in row] for row in rows]

    return {
        lobe_set: {
            family: {"lobes": rounded(fit.lobes), "weights": {name: rounded(rows) for name, rows in fit.weights.items()}}
            for family, fit in fits.items()
        }
        for lobe_set, fits in table.items()
    }


TABLE: Mapping[str, Mapping[str, Fit]] = {
    lobe_set: {
        family: Fit(
            tuple(Lobe(*row) for row in fit["lobes"]),
            {name: tuple(Weight(*row) for row in rows) for name, rows in fit["weights"].items()},
        )
        for family, fit in fits.items()
    }
    for lobe_set, fits in json.loads(Path(__file__).with_suffix(".json").read_text(encoding="utf-8")).items()
}
"""By lobe set and family, which is the name of its first function of the light."""
