# SPDX-License-Identifier: GPL-3.0-or-later
"""The work-precision study: error against seconds for every engine, quality and model, and for what a user would pick instead.

`test_scenes` and `variants` have what is rendered, `run` renders it, `curves` and `fit` make figures of that,
`stability` and `claims` the tables beside them, `page` and `plot` the page. `fit`, `curves`, `page` and `plot` know no bpy.
"""
