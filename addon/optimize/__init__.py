# SPDX-License-Identifier: GPL-3.0-or-later
"""Leaving out what a scene does not need: each of our groups as the least that renders the same picture."""
