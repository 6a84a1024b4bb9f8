# SPDX-License-Identifier: GPL-3.0-or-later
"""The work-precision study: error against seconds for every engine, mode and model, and for what a user would pick instead.

`cases` has the scenes and the variants, `run` renders them in alternation, `curves` and `fit` make figures of what was measured,
`stability` and `claims` the tables beside them, `page` and `plot` the page. `fit`, `curves`, `page` and `plot` know no bpy.
"""
