# SPDX-License-Identifier: GPL-3.0-or-later
"""What work items came to, kept in memory; `farm.results` keeps them on disk. No bpy."""

from collections.abc import Mapping, Sequence
from typing import Any, Self

from true_diffuse.addon.measure.record import Record

type Rendered = tuple[Record, Mapping[str, bytes]]
"""What a work item comes to: its record, and its files by their suffixes."""


class Spec:
    """What is asked for, a frozen dataclass whose sequences are tuples."""

    @classmethod
    def from_json(cls, record: Record) -> Self:
        """Return the spec of which dataclasses.asdict and JSON made `record`."""
        return cls(**{name: tuple(value) if isinstance(value, list) else value for name, value in record.items()})


class WorkError(Exception):
    """A work item cannot be rendered or used; the message is one line for the user, `details` are further lines."""

    def __init__(self, message: str, details: Sequence[str] = ()) -> None:
        super().__init__(message)
        self.details = details


class Outcomes:
    """What work items came to, by their names, in memory."""

    def __init__(self) -> None:
        self._kept: dict[str, Rendered] = {}

    def has(self, name: str) -> bool:
        """Return whether an item is done."""
        return name in self._kept

    def keep(self, name: str, record: Record, files: Mapping[str, bytes]) -> None:
        """Keep what an item came to."""
        self._kept[name] = record, files

    def record(self, name: str) -> Record:
        """Return the record of an item that is done."""
        return self._kept[name][0]

    def read(self, name: str, suffix: str) -> bytes:
        """Return what a file of an item holds."""
        return self._kept[name][1][suffix]


def merged(environments: Sequence[Mapping[str, Any]]) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the first of `environments` with the devices of all, and a list of all different ones; empty where all agree."""
    devices: dict[str, str] = {}
    machines: list[dict[str, Any]] = []
    for environment in environments:
        devices |= environment["devices"]
        machine = {name: value for name, value in environment.items() if name != "devices"}
        if machine not in machines:
            machines.append(machine)
    return machines[0] | {"devices": devices}, machines if len(machines) > 1 else []
