# SPDX-License-Identifier: GPL-3.0-or-later
"""Builds the package, the manual, the previews and the asset library."""
