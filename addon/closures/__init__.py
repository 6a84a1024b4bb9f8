# SPDX-License-Identifier: GPL-3.0-or-later
"""Fits of the models to the closures that EEVEE and Cycles offer. No bpy."""
