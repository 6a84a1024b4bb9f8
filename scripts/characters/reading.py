# SPDX-License-Identifier: GPL-3.0-or-later
"""Limits on time and memory while a file of somebody else is read. No bpy.

Damage in a file may make Blender's own code crash, hang, or ask for more memory than there is. Past a limit the system ends the
process; whoever started it, and gave it a note to write to, reads there which file that was.
"""

import os
import signal
from collections.abc import Generator
from contextlib import contextmanager
from pathlib import Path

SECONDS = 60  # that reading a file may take, and each of its frames
BYTES = 1_000_000  # that give it another second: of a slow disk
MEMORY = 0.75  # of the machine's, on top of what the process has already

_note: Path | None = None
_seconds = 0


def supervised(note: Path) -> None:
    """From now on set limits while files are read, and write to `note` which one it is."""
    global _note
    _note = note


@contextmanager
def limited(file: str | Path) -> Generator[None]:
    """Read a file within the limits, where this process is supervised; Windows has none."""
    if _note is None:
        yield
        return
    global _seconds
    path = Path(file)
    _seconds = SECONDS + (path.stat().st_size // BYTES if path.is_file() else 0)
    _note.write_text(str(file), encoding="utf-8", errors="surrogateescape")
    try:
        with _memory():
            if os.name == "posix":
                signal.alarm(_seconds)  # whose default action needs no Python, which waits for Blender
            try:
                yield
            finally:
                if os.name == "posix":
                    signal.alarm(0)
    finally:
        _note.unlink(missing_ok=True)


def go_on() -> None:
    """Begin the time anew: what takes so long is many frames, not one."""
    if _note is not None and _note.exists() and os.name == "posix":
        signal.alarm(_seconds)


@contextmanager
def _memory() -> Generator[None]:
    """Let the process grow by no more than MEMORY, where the system can limit that."""
    status = Path("/proc/self/statm")
    if not status.exists():
        yield
        return
    import resource

    page = os.sysconf("SC_PAGE_SIZE")
    limit = int(page * (int(status.read_text().split()[0]) + MEMORY * os.sysconf("SC_PHYS_PAGES")))
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    limits = (limit, *(each for each in (soft, hard) if each != resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_AS, (min(limits), hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def ending(note: Path, status: int) -> str:
    """Return in one line why a process ended by a signal or a crash, of which subprocess gave the `status`."""
    name = signal.Signals(-status).name if -status in set(signal.Signals) else f"status {status}"
    if os.name == "posix" and -status == signal.SIGALRM:
        return f"reading {read_last(note)} takes too long: it is damaged, or needs more time than a minute and a second for each MB"
    if file := read_last(note):
        return f"crashed ({name}) while reading {file}: it is damaged, or needs more memory than there is"
    return f"crashed ({name})"


def read_last(note: Path) -> str:
    """Return the file that a process was reading when it ended, empty for none."""
    try:
        return note.read_text(encoding="utf-8", errors="surrogateescape")
    except OSError:
        return ""
