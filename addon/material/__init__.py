# SPDX-License-Identifier: GPL-3.0-or-later
"""Materials: their groups and values read, created, converted, upgraded and described."""
