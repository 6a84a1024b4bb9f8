# SPDX-License-Identifier: GPL-3.0-or-later
"""Names of the custom properties that mark our node trees in files; nothing is imported here, so that handlers are fast."""

GROUP_ID = "true_diffuse"  # of a tree of a group: "key/version"
BUILT_FINGERPRINT = "true_diffuse_as_built"  # `graph.fingerprint` of the tree when it was built
SPECIALIZED_FOR = "true_diffuse_least_for"  # of a tree optimized for one use of its group: that use, see `optimize.folding.Use`
