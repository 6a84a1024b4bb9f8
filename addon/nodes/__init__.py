# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups, built in code, for EEVEE and Cycles."""

from .graph import Group
from .principled import PRINCIPLED
from .rough_diffuse import ROUGH_DIFFUSE
from .specular import SPECULAR_GROUP
from .subsurface import SUBSURFACE

GROUPS: tuple[Group, ...] = (ROUGH_DIFFUSE, PRINCIPLED, SUBSURFACE, SPECULAR_GROUP)

__all__ = ("GROUPS", "PRINCIPLED", "ROUGH_DIFFUSE", "SPECULAR_GROUP", "SUBSURFACE", "Group")
