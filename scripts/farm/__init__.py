# SPDX-License-Identifier: GPL-3.0-or-later
"""Jobs for any number of machines: bundles, the results of work items on disk, the worker that keeps a Blender between tasks.

A work item is the least that is rendered and kept by itself; a task of a job renders one or several. Scripts and tasks render and
collect them by the same functions; what is here only stores and resumes.
"""
