# SPDX-License-Identifier: GPL-3.0-or-later
"""Lets materials appended from our asset library use the groups that the file already has.

Blender copies a group along with each material it appends. The users of the copies get the file's own groups, so that saving
drops the copies. A group that somebody has edited, in the file or in the library, is left alone.
"""

from pathlib import Path

import bpy

from ..blender.extension import ASSET_FILE
from ..blender.handlers import register_handlers_factory
from ..blender.id_properties import BUILT_FINGERPRINT, GROUP_ID, SPECIALIZED_FOR


@bpy.app.handlers.persistent
def share_groups(context: bpy.types.BlendImportContext) -> None:
    """Make materials appended from our library use the file's own groups."""
    appended = {item.id for item in context.import_items if item.id and Path(item.source_library.filepath).name == ASSET_FILE}
    if not appended:
        return
    from ..nodes.graph import fingerprint

    def is_unedited(tree: bpy.types.NodeTree) -> bool:
        return GROUP_ID in tree and SPECIALIZED_FOR not in tree and tree.get(BUILT_FINGERPRINT) == fingerprint(tree)

    trees = [item for item in appended if isinstance(item, bpy.types.ShaderNodeTree) and item.library is None and is_unedited(item)]
    for tree in trees:
        for own in bpy.data.node_groups:
            if own not in appended and own.library is None and own.get(GROUP_ID) == tree[GROUP_ID] and is_unedited(own):
                tree.user_remap(own)
                break


register, unregister = register_handlers_factory((("blend_import_post", share_groups),))
