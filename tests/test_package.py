# SPDX-License-Identifier: GPL-3.0-or-later
"""The package: what Blender's own tool and the extensions platform's review ask of it, and its life in a Blender of its own."""

import argparse
import ast
import hashlib
import json
import re
import shutil
import subprocess
import sys
import threading
import tomllib
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path, PurePosixPath

import pytest

from true_diffuse.addon.blender import extension
from true_diffuse.addon.material.presets import PRESETS
from true_diffuse.addon.nodes import GROUPS
from true_diffuse.scripts.release import package as script

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = {"__init__.py", "blender_manifest.toml", "LICENSE", "addon", "shaders", "scenes"}
NETWORK = {"socket", "ssl", "http", "urllib", "ftplib", "smtplib", "asyncio", "xmlrpc", "webbrowser", "requests"}
# Imported by Blender itself, of this machine, or by no code that enabling runs
HEAVY = (
    "pxr",
    "MaterialX",
    "PyOpenColorIO",
    "OpenImageIO",
    "numpy",
    "true_diffuse.addon.models",
    "true_diffuse.addon.closures",
    "true_diffuse.addon.nodes",
    "true_diffuse.scenes",
)


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return script.build(tmp_path_factory.mktemp("package"))


@pytest.fixture(scope="module")
def names(package: Path) -> list[str]:
    return zipfile.ZipFile(package).namelist()


@pytest.fixture(scope="module")
def trees(package: Path) -> dict[str, ast.Module]:
    """The package's code by path."""
    content = zipfile.ZipFile(package)
    return {name: ast.parse(content.read(name)) for name in content.namelist() if name.endswith(".py")}


@pytest.fixture(scope="module")
def manifest(package: Path) -> dict:
    return tomllib.loads(zipfile.ZipFile(package).read("blender_manifest.toml").decode())


def test_manifest_and_tags_are_valid(package: Path) -> None:
    script.check(package)


def test_unknown_tag_is_noticed(package: Path, tmp_path: Path) -> None:
    with pytest.raises(script.BadInput, match="tags"):
        script.check(changed(package, tmp_path / "bad.zip", lambda text: text.replace('"Material"', '"Chalk"')))


def test_package_is_small(package: Path) -> None:
    assert package.stat().st_size <= script.MAX_SIZE


def test_package_holds_no_test_cache_or_script(names: list[str]) -> None:
    assert {name.split("/")[0] for name in names} == FOLDERS
    assert not [name for name in names if name.endswith((".oso", ".pyc", ".zip", ".blend")) or "/." in name]
    pictures = {f"addon/previews/{key}.webp" for key in (*PRESETS, *(group.key for group in GROUPS))}
    assert {name for name in names if name.endswith((".png", ".webp", ".svg", ".jpg"))} == pictures


def base_of(path: str, node: ast.ImportFrom) -> PurePosixPath:
    """The module or package, as a path without .py, that a relative import in the module at `path` names."""
    return PurePosixPath(path).parents[node.level - 1] / (node.module or "").replace(".", "/")


def imports(path: str, tree: ast.AST) -> Iterator[str]:
    """The package's modules that the module at `path` imports anywhere in it, as paths without .py."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.level:
            base = base_of(path, node)
            yield from map(str, (base, *(base / alias.name for alias in node.names), *base.parents))


def test_package_holds_only_code_that_the_extension_imports(trees: dict[str, ast.Module]) -> None:
    reached, waiting = set(), ["__init__.py"]
    while waiting:
        path = waiting.pop()
        if path not in reached:
            reached.add(path)
            files = [file for name in imports(path, trees[path]) for file in (f"{name}.py", f"{name}/__init__.py".lstrip("./"))]
            waiting += [file for file in files if file in trees]
    assert set(trees) - reached == set()


def test_every_import_within_the_package_is_in_it(trees: dict[str, ast.Module]) -> None:
    missing = []
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ImportFrom) and node.level and node.module:
                base = base_of(path, node)
                if f"{base}.py" not in trees and f"{base}/__init__.py" not in trees:
                    missing.append((path, node.module))
    assert not missing


def test_permissions_are_the_ones_it_needs(manifest: dict) -> None:
    assert set(manifest["permissions"]) == {"files"}


def test_optional_fields_of_the_manifest_are_ours(manifest: dict) -> None:
    assert manifest["blender_version_min"] == "5.2.0" and "wheels" not in manifest and "platforms" not in manifest
    assert all("example" not in str(value).lower() for value in manifest.values())


def modules(tree: ast.AST) -> set[str]:
    found = {alias.name for node in ast.walk(tree) if isinstance(node, ast.Import) for alias in node.names}
    found |= {node.module for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and not node.level and node.module}
    return {name.split(".")[0] for name in found}


def test_nothing_uses_the_network(trees: dict[str, ast.Module]) -> None:
    assert not {path: modules(tree) & NETWORK for path, tree in trees.items() if modules(tree) & NETWORK}


def test_nothing_changes_where_python_looks_for_modules(trees: dict[str, ast.Module]) -> None:
    for path, tree in trees.items():
        attributes = {ast.unparse(node) for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        assert not {"sys.path", "sys.meta_path", "site.addsitedir"} & attributes, path


def test_only_standard_and_blender_s_modules_are_imported(trees: dict[str, ast.Module]) -> None:
    known = {
        "bpy",
        "bpy_extras",
        "bmesh",
        "mathutils",
        "gpu",
        "cycles",
        "pxr",
        "MaterialX",
        "PyOpenColorIO",
        "OpenImageIO",
        "oslquery",
        "io_scene_gltf2",
    }
    for path, tree in trees.items():
        assert modules(tree) <= known | set(sys.stdlib_module_names), path


def test_code_is_not_loaded_from_text(trees: dict[str, ast.Module]) -> None:
    for path, tree in trees.items():
        calls = {ast.unparse(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
        assert not calls & {"exec", "eval", "compile", "os.system"}, path


def test_preferences_and_user_folders_go_by_the_package_s_name(trees: dict[str, ast.Module]) -> None:
    for path, tree in trees.items():
        for node in ast.walk(tree):
            assert not (isinstance(node, ast.Name) and node.id == "__name__"), path
            if isinstance(node, ast.Call) and ast.unparse(node.func).endswith("extension_path_user"):
                assert ast.unparse(node.args[0]) == "PACKAGE", path
    assert not [path for path, tree in trees.items() if "bl_info" in ast.dump(tree)]


def test_classes_are_named_as_blender_wants_it(trees: dict[str, ast.Module]) -> None:
    for path, tree in trees.items():
        for node in ast.walk(tree):
            if isinstance(node, ast.ClassDef) and re.match(r"[A-Z_]+_(OT|MT|PT|UL|HT)_", node.name):
                assert node.name.startswith("TRUE_DIFFUSE_"), path
                fields = {ast.unparse(part.targets[0]): part.value for part in node.body if isinstance(part, ast.Assign)}
                wanted = node.name
                if "_OT_" in node.name:
                    wanted = f"true_diffuse.{node.name.partition('_OT_')[2]}"
                    assert "bl_idname" in fields
                assert "bl_idname" not in fields or ast.literal_eval(fields["bl_idname"]) == wanted
                tip = ast.get_docstring(node) or ""
                assert tip and tip[0].isupper() and not tip.endswith("."), node.name


def manifest_of(package: Path) -> str:
    return zipfile.ZipFile(package).read("blender_manifest.toml").decode()


def test_website_is_all_that_changes_in_the_package(package: Path, tmp_path: Path) -> None:
    path = shutil.copy(package, tmp_path)
    script.set_website(path, "https://studio.test/docs/")
    script.check(path)
    assert tomllib.loads(manifest_of(path)) == tomllib.loads(manifest_of(package)) | {"website": "https://studio.test/docs/"}
    before, after = zipfile.ZipFile(package), zipfile.ZipFile(path)
    assert after.namelist() == before.namelist()
    assert all(after.read(name) == before.read(name) for name in before.namelist() if name != "blender_manifest.toml")


@pytest.mark.parametrize(
    "text", ["ftp://studio.test", "studio.test", "https://", 'https://studio.test/"', "https://studio.test/a b"]
)
def test_website_is_an_address_of_the_web(text: str) -> None:
    with pytest.raises(argparse.ArgumentTypeError, match="no address of http or https"):
        script.web_address(text)


def test_extension_reads_the_website_of_its_manifest(package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert extension.website() is None  # of this checkout, which has no public address
    path = shutil.copy(package, tmp_path)
    script.set_website(path, "https://studio.test/docs/")
    zipfile.ZipFile(path).extract("blender_manifest.toml", tmp_path)
    monkeypatch.setattr(extension, "MANIFEST", tmp_path / "blender_manifest.toml")
    monkeypatch.setattr(extension, "manifest", extension.manifest.__wrapped__)  # which keeps nothing
    assert extension.website() == "https://studio.test/docs/"


def test_repository_lists_the_package_and_what_else_is_there(package: Path, tmp_path: Path) -> None:
    older = re.sub(r"[^-]+$", "0.0.1.zip", package.name)
    changed(package, tmp_path / older, lambda text: re.sub(r'(?m)^version = ".*"', 'version = "0.0.1"', text))
    changed(package, tmp_path / "other-1.0.0.zip", lambda text: re.sub(r'(?m)^id = ".*"', 'id = "other"', text))
    (tmp_path / "notes.zip").write_text("none")
    blocked = {"id": "bad", "reason": "crashes"}
    settings = [f'{name} = "{text}"' for name, text in blocked.items()]
    (tmp_path / "blender_repo.toml").write_text("\n".join(['schema_version = "1.0.0"', "[[blocklist]]", *settings]))
    command = [sys.executable, ROOT / "scripts/release/package.py", "--repository", tmp_path]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    written = {"index.html", "index.json", package.name}
    assert {path.name for path in tmp_path.iterdir()} == {*written, "blender_repo.toml", "notes.zip", "other-1.0.0.zip"}
    assert f"Removed {tmp_path / older}" in result.stdout and "'notes.zip'" in result.stdout
    listing = json.loads((tmp_path / "index.json").read_text())
    assert listing["blocklist"] == [blocked]
    entries = {entry["id"]: entry for entry in listing["data"]}
    assert set(entries) == {"true_diffuse", "other"}
    for entry, name in ((entries["true_diffuse"], package.name), (entries["other"], "other-1.0.0.zip")):
        content = (tmp_path / name).read_bytes()
        assert entry["archive_url"] == f"./{name}" and entry["archive_size"] == len(content)
        assert entry["archive_hash"] == f"sha256:{hashlib.sha256(content).hexdigest()}"
    assert package.name in (tmp_path / "index.html").read_text()


class Quiet(SimpleHTTPRequestHandler):
    def log_message(self, *arguments: object) -> None:
        """Say nothing."""


def test_blender_installs_from_a_repository_and_updates_from_it(package: Path, tmp_path: Path) -> None:
    versions = {}
    for version in ("0.2.0", "0.2.1"):
        versions[version] = tmp_path / version
        versions[version].mkdir()
        path = versions[version] / f"true_diffuse-{version}.zip"
        changed(package, path, partial(re.sub, r'(?m)^version = ".*"', f'version = "{version}"'))
        assert script.list_packages(path.parent, []) == []
    served = tmp_path / "served"
    with ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=served)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        code = f"""
import bpy, shutil
from pathlib import Path

def serve(folder):
    shutil.rmtree({str(served)!r}, ignore_errors=True)
    shutil.copytree(folder, {str(served)!r})

def version():
    manifest = Path(repository.directory) / "true_diffuse" / "blender_manifest.toml"
    return manifest.read_text().partition("\\nversion = ")[2].split()[0].strip('"')

preferences = bpy.context.preferences
preferences.system.use_online_access = True
repository = preferences.extensions.repos.new(
    name="Studio", module="studio", remote_url="http://127.0.0.1:{server.server_port}/index.json"
)
index = list(preferences.extensions.repos).index(repository)
serve({str(versions["0.2.0"])!r})
assert bpy.ops.extensions.repo_sync(repo_index=index) == {{"FINISHED"}}
bpy.ops.extensions.package_install(repo_index=index, pkg_id="true_diffuse", enable_on_install=True)
name = "bl_ext.studio.true_diffuse"
assert version() == "0.2.0" and name in preferences.addons
preferences.addons[name].preferences.report = "//mine.json"
folder = Path(bpy.utils.extension_path_user(name, path="assets", create=True))
(folder / "true_diffuse.blend").touch()  # in place of seconds in which Add Asset Library builds it
preferences.filepaths.asset_libraries.new(name="True Diffuse", directory=str(folder))
libraries = [(library.name, library.path) for library in preferences.filepaths.asset_libraries]

serve({str(versions["0.2.1"])!r})
assert bpy.ops.extensions.repo_sync(repo_index=index) == {{"FINISHED"}}
bpy.ops.extensions.package_upgrade_all()
assert version() == "0.2.1" and name in preferences.addons
assert preferences.addons[name].preferences.report == "//mine.json"
assert [(library.name, library.path) for library in preferences.filepaths.asset_libraries] == libraries
assert (folder / "true_diffuse.blend").is_file()
bpy.ops.mesh.primitive_cube_add()
assert bpy.ops.true_diffuse.assign_preset(key="chalk") == {{"FINISHED"}}
print("updated")
"""
        said = script.blender(str(tmp_path / "profile"), code)
        server.shutdown()
    assert "updated" in said


def changed(package: Path, target: Path, manifest: Callable[[str], str]) -> Path:
    """A copy of `package` with another manifest."""
    source = zipfile.ZipFile(package)
    with zipfile.ZipFile(target, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            copy.writestr(name, manifest(content.decode()) if name == "blender_manifest.toml" else content)
    return target


def test_enabling_imports_nothing_heavy() -> None:
    code = f"""
import sys
sys.path.insert(0, {str(ROOT / "scripts")!r})
import checkout, bpy
before = set(sys.modules)
import true_diffuse
true_diffuse.register()
print("imported", *sorted(set(sys.modules) - before))
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    imported = next(line.split()[1:] for line in result.stdout.splitlines() if line.startswith("imported"))
    assert "true_diffuse.addon.operators" in imported  # it did run
    assert not [name for name in imported if name.startswith(HEAVY)]


def test_engine_that_is_loaded_while_blender_is_idle_has_nothing_left_to_load() -> None:
    code = f"""
import sys
sys.path.insert(0, {str(ROOT / "scripts")!r})
import checkout, bpy
import true_diffuse
true_diffuse.register()
from true_diffuse.addon.realtime import preload
steps = []
while True:
    before = set(sys.modules)
    more = preload.load_next()
    steps.append(bool(set(sys.modules) - before))
    if more is None:
        break
before = set(sys.modules)
from true_diffuse.addon.realtime import final, passes, viewport
print("steps", steps, "left", sorted(set(sys.modules) - before))
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert f"steps {[True] * 4} left []" in result.stdout


def test_install_enable_use_disable_upgrade_uninstall(package: Path, tmp_path: Path) -> None:
    older = changed(package, tmp_path / "older.zip", lambda text: re.sub(r'(?m)^version = ".*"', 'version = "0.0.1"', text))
    code = f"""
import bpy
from pathlib import Path

NAME = {script.MODULE!r}
folder = Path(bpy.utils.user_resource("EXTENSIONS")) / "user_default" / "true_diffuse"

def files():
    return {{str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts}}

def version():
    return (folder / "blender_manifest.toml").read_text().partition("\\nversion = ")[2].split()[0].strip('"')

def is_on():
    return NAME in bpy.context.preferences.addons and hasattr(bpy.types, "TRUE_DIFFUSE_OT_add_group")

bpy.ops.extensions.package_install_files(filepath={str(older)!r}, repo="user_default", enable_on_install=True)
assert is_on() and version() == "0.0.1"
installed = files()
bpy.context.preferences.addons[NAME].preferences.report = "//mine.json"

bpy.ops.mesh.primitive_cube_add()
for key in ("fair_skin", "chalk"):
    assert bpy.ops.true_diffuse.assign_preset(key=key) == {{"FINISHED"}}
assert bpy.context.object.active_material.node_tree.nodes["Rough Diffuse"].node_tree["true_diffuse"]

bpy.ops.preferences.addon_disable(module=NAME)
assert not is_on() and bpy.context.object.active_material.node_tree.nodes["Rough Diffuse"].node_tree
bpy.ops.preferences.addon_enable(module=NAME)
assert is_on() and files() == installed, files() ^ installed

bpy.context.preferences.addons[NAME].preferences.report = "//mine.json"
bpy.ops.extensions.package_install_files(filepath={str(package)!r}, repo="user_default", enable_on_install=True)
assert is_on() and version() == {manifest_version()!r} and files() == installed
assert bpy.context.preferences.addons[NAME].preferences.report == "//mine.json"
assert bpy.ops.true_diffuse.assign_preset(key="marble") == {{"FINISHED"}}

index = next(i for i, repo in enumerate(bpy.context.preferences.extensions.repos) if repo.module == "user_default")
bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="true_diffuse")
assert not is_on() and not folder.exists()
assert bpy.context.object.active_material.node_tree.nodes["Subsurface"].node_tree["true_diffuse"]
print("whole life")
"""
    assert "whole life" in script.blender(str(tmp_path / "profile"), code)


def manifest_version() -> str:
    return tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]


def test_project_and_extension_have_one_version() -> None:
    assert tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"] == manifest_version()
