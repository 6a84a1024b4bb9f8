# SPDX-License-Identifier: GPL-3.0-or-later
"""The node groups, built in code: for EEVEE, and for Cycles without OSL."""

from .graph import Group
from .lambert import LAMBERT
from .oren_nayar import OREN_NAYAR
from .specular import SPECULAR_GROUP

GROUPS: tuple[Group, ...] = (LAMBERT, SPECULAR_GROUP, OREN_NAYAR)

__all__ = ("GROUPS", "LAMBERT", "OREN_NAYAR", "SPECULAR_GROUP", "Group")
