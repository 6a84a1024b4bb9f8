# SPDX-License-Identifier: GPL-3.0-or-later
"""From the package on disk to the first matte picture, by mouse but for the folder's path, with clicks and seconds counted.

The places to click are those of the default layout in a window of 1600 x 1000 at Resolution Scale 1. The walk takes some 2 s for
each click, as an artist who reads what there is to click.
"""

import subprocess
import time

import bpy

from window import REPOSITORY, Steps, close_other_windows, cube, folder, group_of, mouse, package, picture, point, say

VIEW = "1200x700+50+120"  # of the screen: the 3D Viewport
INSTALL = (  # buttons and entries
    (79, 14),  # Edit
    (131, 282),  # Preferences
    (173, 258),  # Get Extensions
    (956, 81),  # its menu
    (852, 204),  # Install from Disk
    (680, 32),  # the path
)
FILE, CONFIRM = (484, 93), (1135, 615)
CHALK = ((1333, 654), (1384, 466), (1094, 578))  # the Material tab, what opens the gallery, the preset
RENDERED = (1273, 39)  # the viewport's shading

clicks = 0


def click(x: int, y: int) -> Steps:
    global clicks
    point(x, y)
    yield 0.6
    mouse("click", 1)
    clicks += 1
    yield 1.5


def seen() -> bytes:
    """Return the pixels of the 3D Viewport."""
    return subprocess.run(["import", "-window", "root", "-crop", VIEW, "rgb:-"], capture_output=True, check=True).stdout


def walk() -> Steps:
    global clicks
    repositories = bpy.context.preferences.extensions.repos
    index = next(index for index, repository in enumerate(repositories) if repository.module == REPOSITORY)
    bpy.ops.extensions.package_uninstall(repo_index=index, pkg_id="true_diffuse")
    downloads = folder / "downloads"
    downloads.mkdir()
    package.rename(downloads / package.name)
    yield 2.0
    start = time.monotonic()
    for place in INSTALL:
        yield from click(*place)
    mouse("key", "ctrl+a")
    mouse("type", str(downloads))
    mouse("key", "Return")
    yield 2.0
    yield from click(*FILE)  # ends the typing
    yield from click(*FILE)
    picture("chosen")
    yield from click(*CONFIRM)
    yield 2.0
    assert "bl_ext.user_default.true_diffuse" in bpy.context.preferences.addons
    picture("installed")
    close_other_windows()  # a click on the window's frame, which this display draws none of
    clicks += 1
    yield 1.0
    for place in CHALK:
        yield from click(*place)
    assert group_of(cube().active_material.name) == "Rough Diffuse"
    mouse("key", "Escape")
    yield 0.5
    by_hand = time.monotonic() - start
    solid = before = seen()
    yield from click(*RENDERED)
    rendering = time.monotonic()
    while (now := seen()) != before or now == solid:
        before = now
        yield 1.0
    rendered = time.monotonic() - rendering - 1.0  # the last second saw no change
    picture("rendered")
    say(f"{clicks} clicks, {by_hand:.0f} s to the material, {rendered:.0f} s more until the viewport's picture is whole")
