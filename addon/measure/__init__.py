# SPDX-License-Identifier: GPL-3.0-or-later
"""Measuring renders against the analytic models: what a pixel should be, what it is, and a picture of the difference."""
