# SPDX-License-Identifier: GPL-3.0-or-later
"""Web engines as referees: three.js and Babylon.js in a headless Chromium. No bpy.

package.json  the engines, in exact versions
packages.py   fetches them, and what godot/ and khronos/ name, by npm, into a cache outside the checkout
browser.py    a Chromium that draws in software and is kept from the network. Needs the package playwright
engines.py    glTF files drawn by both engines into linear floats: three.html, three.js, babylon.html, babylon.js, pixels.js
validator.py  Khronos' validator, run by node: khronos/validate.cjs
"""


class WebError(Exception):
    """What a page needs is not here, or a page failed; the message is one line."""
