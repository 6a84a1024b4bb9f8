# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes built in code, used by the scripts, the tests and the add-on alike."""
