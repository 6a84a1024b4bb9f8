# SPDX-License-Identifier: GPL-3.0-or-later
"""Node trees specialized for one use of a group: they render the same picture with fewer nodes and closures."""
