# SPDX-License-Identifier: GPL-3.0-or-later
"""Measurements behind the figures: each study yields records for a results file and makes tables or pictures of them."""
