# SPDX-License-Identifier: GPL-3.0-or-later
"""The add-on: registered in order, unregistered in reverse. Nothing heavy is imported before it is used."""


def register() -> None:
    from . import operators, ui

    operators.register()
    ui.register()


def unregister() -> None:
    from . import operators, ui

    ui.unregister()
    operators.unregister()
