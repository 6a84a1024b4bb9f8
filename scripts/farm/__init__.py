# SPDX-License-Identifier: GPL-3.0-or-later
"""Studies cut into parts that any number of machines can do: what is ordered, the parts' results on disk, the job that does them.

A part is the least that is done and kept by itself; a task of a job does one part or several. Whoever does them, a script at once
or a task of a job, goes through the same functions, and so does who collects them.
"""
