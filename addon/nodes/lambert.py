# SPDX-License-Identifier: GPL-3.0-or-later
"""Node group Lambert: L_r = (rho / pi) E0 (N.L)."""

from .graph import COLOR, NORMAL, Graph, Group, Value


def build(graph: Graph) -> Value:
    return graph.diffuse(graph.input(COLOR), graph.normal())


LAMBERT = Group(
    key="lambert",
    name="True Diffuse Lambert",
    version=1,
    description="Ideal diffuse reflection, the same brightness from every view",
    inputs=(COLOR, NORMAL),
    build=build,
)
