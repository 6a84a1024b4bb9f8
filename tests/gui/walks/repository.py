# SPDX-License-Identifier: GPL-3.0-or-later
"""A static repository on this machine: added, installed from, and updated from, in the preferences; and the online manual."""

import re
import shutil
import socket
import subprocess
import sys
import webbrowser
import zipfile
from pathlib import Path

import bpy

from window import (
    REPOSITORY,
    Steps,
    area,
    assign,
    close_other_windows,
    cube,
    folder,
    menu,
    middle,
    mouse,
    package,
    picture,
    point,
    within,
)

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / "scripts"))

import checkout  # noqa: F401 - makes this checkout the package true_diffuse

NEWER = "99.0.0"
SERVED = folder / "served"
SITE = "http://127.0.0.1/docs/"


def serve(version: str) -> None:
    """Let the repository offer the package as this version."""
    from true_diffuse.scripts.release import package as script

    shutil.rmtree(SERVED, ignore_errors=True)
    SERVED.mkdir()
    path = SERVED / f"true_diffuse-{version}.zip"
    with zipfile.ZipFile(package) as source, zipfile.ZipFile(path, "w") as target:
        for entry in source.infolist():
            content = source.read(entry)
            if entry.filename == "blender_manifest.toml":
                content = re.sub(rb'(?m)^version = ".*"', f'version = "{version}"'.encode(), content)
            target.writestr(entry, content)
    script.set_website(path, SITE)
    assert script.list_packages(SERVED, []) == []


def installed(repository: bpy.types.UserExtensionRepo) -> str:
    """Return the version that is installed."""
    manifest = (Path(repository.directory) / "true_diffuse" / "blender_manifest.toml").read_text()
    return manifest.partition("\nversion = ")[2].split()[0].strip('"')


def walk() -> Steps:
    """Add a repository of this machine, install True Diffuse from it and update it, looking at Get Extensions."""
    preferences = bpy.context.preferences
    repositories = preferences.extensions.repos
    index = next(index for index, repository in enumerate(repositories) if repository.module == REPOSITORY)
    bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="true_diffuse")
    older = package.stem.rpartition("-")[2]
    serve(older)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    command = [sys.executable, "-m", "http.server", str(port), "--bind", "127.0.0.1", "--directory", str(SERVED)]
    server = subprocess.Popen(command)
    try:
        yield from add_install_update(f"http://127.0.0.1:{port}/index.json", older)
        yield from read_the_manual()
    finally:
        server.terminate()


def add_install_update(address: str, older: str) -> Steps:
    preferences, manager = bpy.context.preferences, bpy.context.window_manager
    preferences.system.use_online_access = True
    bpy.ops.screen.userpref_show()
    yield 2.0
    preferences.active_section = "EXTENSIONS"
    manager.extension_search = "True Diffuse"
    yield 2.0
    with bpy.context.temp_override(window=manager.windows[-1]):
        bpy.ops.preferences.extension_repo_add("INVOKE_DEFAULT", type="REMOTE")
    yield 2.0
    mouse("type", address)
    yield 1.0
    picture("add_remote")
    mouse("key", "Return")  # ends the typing
    yield 1.0
    mouse("key", "Return")
    yield 4.0
    repository = next(repository for repository in preferences.extensions.repos if repository.remote_url == address)
    index = list(preferences.extensions.repos).index(repository)
    module = f"bl_ext.{repository.module}.true_diffuse"
    bpy.ops.extensions.repo_sync(repo_index=index)
    bpy.ops.extensions.package_show_set(repo_index=index, pkg_id="true_diffuse")
    yield 2.0
    picture("offered")
    bpy.ops.extensions.package_install(repo_index=index, pkg_id="true_diffuse", enable_on_install=True)
    yield 2.0
    assert installed(repository) == older and module in preferences.addons
    preferences.addons[module].preferences.report = "//mine.json"
    picture("installed")
    serve(NEWER)
    bpy.ops.extensions.repo_sync(repo_index=index)
    yield 2.0
    picture("update_offered")
    bpy.ops.extensions.package_upgrade_all()
    yield 2.0
    assert installed(repository) == NEWER and module in preferences.addons
    assert preferences.addons[module].preferences.report == "//mine.json"
    picture("updated")
    preferences.active_section = "ADDONS"
    manager.addon_search = "True Diffuse"
    bpy.ops.preferences.addon_expand(module=module)
    yield 2.0
    picture("preferences")


def read_the_manual() -> Steps:
    """Open the manual's page of a node from its context menu."""
    close_other_windows()
    yield 1.0
    assign(cube(), "chalk")
    editor = area("VIEW_3D")
    editor.ui_type = "ShaderNodeTree"
    yield 2.0
    nodes = cube().active_material.node_tree.nodes
    nodes.active = nodes["Rough Diffuse"]
    with within(editor):
        bpy.ops.node.view_all()
    point(*middle(editor))
    yield 1.0
    menu(editor, "NODE_MT_context_menu")
    yield 2.0
    picture("node_menu")
    mouse("key", "Escape")
    yield 1.0
    opened: list[str] = []
    webbrowser.open = opened.append
    with within(editor):
        bpy.ops.wm.doc_view_manual(doc_id="ShaderNodeGroup")
        bpy.ops.wm.doc_view_manual(doc_id="true_diffuse.assign_preset")
    assert opened == [f"{SITE}manual/rough_diffuse.html", f"{SITE}gallery.html"], opened
