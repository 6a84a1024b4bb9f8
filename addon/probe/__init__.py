# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures a material in the current engine, and picks modes and samples for a wanted error."""
