# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits the numbers in addon/closures/ and shaders/ to the formulas."""
