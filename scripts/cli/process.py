# SPDX-License-Identifier: GPL-3.0-or-later
"""A script's work is done in a process of its own, so that one line is all that is seen of whatever ends it. No bpy.

Blender's own code may crash on a damaged file, and does not let Python have an interrupt while it renders. So the first process
only waits, for the second and for signals, and cleans up after it.
"""

import os
import select
import signal
import subprocess
import sys
import tempfile
from collections.abc import Callable, Generator, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

from true_diffuse.scripts.characters import reading
from true_diffuse.scripts.cli.console import say_error, say_stopped, show_cursor

ROOM = "TRUE_DIFFUSE_ROOM"  # the environment variable that tells the second process its folder
NOTE = "reading"  # in that folder: the file that is being read


class Stopped(BaseException):
    """A signal asked to end; `number` is which."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.number = number


def room() -> Path | None:
    """Return the folder of a process that is the second, which from then on ends with the first; None in the first."""
    given = os.environ.pop(ROOM, None)
    if given is None:
        return None
    _end_with_input()
    reading.supervised(Path(given, NOTE))
    return Path(given)


def alone(prog: str, work: Callable[[], int], left: str) -> int:
    """Do `work` in the second process, which has no output folder; return the exit status, having said what it crashed of.

    `left` is what an interrupt leaves, in words.
    """
    if room() is not None:
        return work()
    with tempfile.TemporaryDirectory(prefix="true_diffuse_") as folder:
        try:
            ended = again(Path(folder))
        except Stopped as stopped:
            return say_stopped(prog, left, stopped.number)
    return ended if isinstance(ended, int) else say_error(prog, ended)


def again(folder: Path) -> int | str:
    """Run this script again as the second process, with a `folder` of its own; return its exit status, or what it crashed of.

    Raises Stopped where this process is asked to end; the second is gone by then.
    """
    process: subprocess.Popen[bytes] | None = None
    with _signals() as inherited:
        try:
            process = subprocess.Popen(_command(), stdin=subprocess.PIPE, env=os.environ | {ROOM: str(folder)})
            inherited()
            status = process.wait()
        finally:
            if process and process.poll() is None:
                process.kill()
                process.wait()
            show_cursor()
    return status if 0 <= status < 256 else reading.ending(folder / NOTE, status)  # Windows has large numbers for crashes


def _command() -> Sequence[str]:
    if sys.argv[0].endswith(".py"):
        return [sys.executable, *sys.orig_argv[1:]]
    import bpy

    return [bpy.app.binary_path, *sys.argv[1:]]


@contextmanager
def _signals() -> Generator[Callable[[], None]]:
    """Raise Stopped for an interrupt (Ctrl-C) or a request to end, once the function is called that this yields.

    What is started before inherits that they are blocked: this process tells it to end, not the terminal.
    """
    blocks = hasattr(signal, "pthread_sigmask")

    def unblock() -> None:
        if blocks:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, numbers)

    def stop(number: int, _frame: FrameType | None) -> None:
        raise Stopped(number)

    numbers = {signal.SIGINT, signal.SIGTERM}
    if hasattr(signal, "SIGHUP") and signal.getsignal(signal.SIGHUP) != signal.SIG_IGN:  # which nohup asks for
        numbers.add(signal.SIGHUP)
    if blocks:
        signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
    before = {number: signal.signal(number, stop) for number in numbers}
    try:
        yield unblock
    finally:
        unblock()
        for number, handler in before.items():
            signal.signal(number, handler)


def _end_with_input() -> None:
    """End this process when its input does, as it does with the first process, however that ends."""
    try:
        import fcntl
    except ImportError:  # Windows
        import threading

        threading.Thread(target=lambda: (sys.stdin.buffer.read(), os._exit(1)), daemon=True).start()
        return
    # The system ends it by SIGIO, without Python, which waits for Blender.
    fcntl.fcntl(0, fcntl.F_SETOWN, os.getpid())
    fcntl.fcntl(0, fcntl.F_SETFL, fcntl.fcntl(0, fcntl.F_GETFL) | os.O_ASYNC)
    if select.select([0], [], [], 0.0)[0]:  # it has ended already
        os._exit(1)
