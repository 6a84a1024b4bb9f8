# SPDX-License-Identifier: GPL-3.0-or-later
"""True Diffuse: the extension's entry point; everything lives in the package `addon`."""

from .addon import glTF2ExportUserExtension, glTF2ImportUserExtension, register, unregister

__all__ = ("glTF2ExportUserExtension", "glTF2ImportUserExtension", "register", "unregister")
