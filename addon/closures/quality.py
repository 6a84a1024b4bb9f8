# SPDX-License-Identifier: GPL-3.0-or-later
"""The entries of the menu Quality, and which lobes EEVEE gets for each. No bpy."""

from .lobe import PAIR, SIGNED, SINGLE

BALANCED, FAST, PRECISE, CHOSEN_LIGHTS = "Balanced", "Fast", "Precise", "Exact for Chosen Lights"
EEVEE_LOBES = {BALANCED: PAIR, FAST: SINGLE, PRECISE: SIGNED, CHOSEN_LIGHTS: PAIR}
"""By quality. For chosen lights: of the models that have no such form."""
NUMBERS = {quality: number for number, quality in enumerate(EEVEE_LOBES)}
"""What node groups know the qualities by."""
