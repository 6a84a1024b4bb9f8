# SPDX-License-Identifier: GPL-3.0-or-later
"""The work-precision study: error against seconds for every engine, quality and model, and for what a user would pick instead.

`test_scenes` and `variants` have what is rendered, `run` renders it, `curves` makes figures of that, `stability` and `claims` the
tables beside them, `page` and `plot` the page. `curves`, `page` and `plot` know no bpy. What the extension's own, small benchmark
does as well is in `addon/probe`: the scenes, the fits of a curve.
"""
