# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes built in code: the five characters, which the add-on offers, and the sphere and slab that its probe measures on.

Scripts and tests use them, too.
"""
