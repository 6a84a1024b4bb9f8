# SPDX-License-Identifier: GPL-3.0-or-later
"""The comparisons of scripts/compare.py, cut into work items that one process or any number of machines can render.

`base` has what both share, `five` the five characters against the models, `face` the heads in one engine against another.
"""
