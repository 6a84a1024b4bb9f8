# SPDX-License-Identifier: GPL-3.0-or-later
"""Renders of single objects, and their errors relative to the reflectance models."""
