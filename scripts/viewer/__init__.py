# SPDX-License-Identifier: GPL-3.0-or-later
"""The five characters in the browser: one file of HTML that asks for no other, drawn by the functions of shaders/ in WebGL 2.

page.py       puts the file together: the page, its program, the GLSL, and a character
geometry.py   a character as triangles in few bytes
albedo.py     what a character as it is gets of its materials: their albedo, baked by Cycles
page.html, page.css, viewer.js   the page and its program
*.glsl        the viewer's own shaders, around those of shaders/
"""
