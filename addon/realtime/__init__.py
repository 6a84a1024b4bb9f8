# SPDX-License-Identifier: GPL-3.0-or-later
"""A render engine of its own: draws with shaders/*.glsl in the viewport, in final and in headless renders."""
