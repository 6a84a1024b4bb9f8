# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets materials that are appended from our asset library share one copy of each group with the file.

Blender copies a group along with each material it appends. The users of the copies get the file's own groups, so that saving
drops the copies. A group that somebody has edited, in the file or in the library, is left alone.
"""

from pathlib import Path

import bpy

from ..blender.extension import ASSET_FILE
from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR


@bpy.app.handlers.persistent
def share(context: bpy.types.BlendImportContext) -> None:
    """Make what was appended from our library use the file's own groups."""
    came = {item.id for item in context.import_items if item.id and Path(item.source_library.filepath).name == ASSET_FILE}
    if not came:
        return
    from ..nodes.graph import fingerprint

    def as_built(tree: bpy.types.NodeTree) -> bool:
        return GROUP_ID in tree and SPECIALIZED_FOR not in tree and tree.get(BUILT_FINGERPRINT) == fingerprint(tree)

    trees = [item for item in came if isinstance(item, bpy.types.ShaderNodeTree) and item.library is None and as_built(item)]
    for tree in trees:
        for own in bpy.data.node_groups:
            if own not in came and own.library is None and own.get(GROUP_ID) == tree[GROUP_ID] and as_built(own):
                tree.user_remap(own)
                break


def register() -> None:
    bpy.app.handlers.blend_import_post.append(share)


def unregister() -> None:
    bpy.app.handlers.blend_import_post.remove(share)
