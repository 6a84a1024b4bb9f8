# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a material in the scene's engine, and picks qualities and sample counts for a wanted error."""
