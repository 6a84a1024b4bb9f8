# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the custom properties that mark our trees, nodes and materials in files; nothing is imported here, for fast handlers."""

GROUP_ID = "true_diffuse"  # of a tree of a group: "key/version"
BUILT_FINGERPRINT = "true_diffuse_as_built"  # `graph.fingerprint` of the tree when it was built
SPECIALIZED_FOR = "true_diffuse_least_for"  # of a tree that an earlier version optimized for one use of its group: that use
LIGHT_TYPES = "true_diffuse_light_types"  # of a tree of chosen lights: the types that their nodes were made for, in their order
CONVERTED_FROM = "true_diffuse_converted_from"  # of a node of ours: what it was before, see `material.original.Original`
THICKNESS_CHANGED = "true_diffuse_thickness_changed"  # of a material: we have switched its Thickness From Shadow on
THICKNESS_OF = "true_diffuse_thickness_of"  # of a material: the name of the node for which we have set its Thickness
MATERIAL_MARKS = (THICKNESS_CHANGED, THICKNESS_OF)  # all that materials have
