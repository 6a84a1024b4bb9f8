# SPDX-License-Identifier: GPL-3.0-or-later
"""Scenes built in code, used by comparison and accuracy, the scripts and the tests."""
