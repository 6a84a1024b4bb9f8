# SPDX-License-Identifier: GPL-3.0-or-later
"""What scripts and tests measure: each study yields records, for a file, and makes a table or a picture of them, for people."""
