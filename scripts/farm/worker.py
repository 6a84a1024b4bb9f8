# SPDX-License-Identifier: GPL-3.0-or-later
"""A process that keeps Blender and its scene between tasks, and how tasks talk to it. No bpy.

It listens on this machine alone. Where it does and a word to know its own clients by stand in a file of the session's folder. A
request is a line of JSON, answered by lines: how far the work is, and at last `done` or what failed. A task that goes away leaves
the work to be finished, as its results count all the same. A worker ends with its session, or where nobody asks for long.
"""

import json
import os
import secrets
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

from true_diffuse.scripts.characters import reading
from true_diffuse.scripts.cli.console import Show
from true_diffuse.scripts.farm.results import write_whole
from true_diffuse.scripts.studies.comparison.outcomes import WorkError

ADDRESS, LOG = "worker.json", "worker.log"
NOTE = "worker.reading"  # the file that it is reading
START_SECONDS = 300.0  # a cold Blender on a slow disk, and the question whether EEVEE runs, which starts another
IDLE_SECONDS = 900.0  # until a worker that nobody asks ends
LOOK_SECONDS = 2.0  # between looks whether the session still lives
LAST_WORDS = 300  # characters of the log that an error shows

type Request = dict[str, Any]


def serve(session: Path, keeper: int, do: Callable[[Request, Show], list[str]]) -> None:
    """Do what tasks ask for, one after another, until nobody asks for IDLE_SECONDS or the session is gone.

    It is where its folder is, or the process `keeper` that runs it. What `do` returns are lines for the task to say.
    """
    word = secrets.token_hex(16)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(LOOK_SECONDS)
        address = {"port": server.getsockname()[1], "word": word, "process": os.getpid()}
        write_whole(session / ADDRESS, json.dumps(address).encode())
        (session / ADDRESS).chmod(0o600)
        last = time.monotonic()
        while time.monotonic() - last < IDLE_SECONDS and session.is_dir() and _lives(keeper):
            try:
                client, _ = server.accept()
            except TimeoutError:
                continue
            client.settimeout(None)
            with suppress(OSError, ValueError), client, client.makefile("rw", encoding="utf-8") as stream:
                request = json.loads(stream.readline())
                if secrets.compare_digest(str(request.pop("word", "")), word):
                    _answer(request, stream, do)
            last = time.monotonic()


def _lives(process: int) -> bool:
    """Return whether a process is there, as far as the system tells."""
    if os.name == "posix":
        try:
            os.kill(process, 0)
        except ProcessLookupError:
            return False
        except PermissionError:
            return True
    return True


def _answer(request: Request, stream: IO[str], do: Callable[[Request, Show], list[str]]) -> None:
    def say(line: dict[str, Any]) -> None:
        with suppress(OSError):  # the task is gone
            stream.write(json.dumps(line) + "\n")
            stream.flush()

    try:
        said = do(request, lambda percent, text: say({"percent": percent, "text": text}))
    except WorkError as error:
        say({"fail": str(error), "details": error.details})
    else:
        say({"done": said})


def begin(session: Path, command: Sequence[str | Path]) -> None:
    """Start a worker with `command` and wait until it listens; raises WorkError with its last words where it does not."""
    (session / ADDRESS).unlink(missing_ok=True)
    with (session / LOG).open("ab") as log:
        process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=log,
            start_new_session=True,
            env=os.environ | {"TMPDIR": str(session)},
        )
    start = time.monotonic()
    while not (session / ADDRESS).exists():
        if process.poll() is not None:
            raise WorkError(f"Blender ended at its start: {last_words(session)}")
        if time.monotonic() - start > START_SECONDS:
            process.kill()
            raise WorkError(f"Blender did not start in {START_SECONDS:.0f} s: {last_words(session)}")
        time.sleep(0.05)


def ask(session: Path, request: Request, show: Show) -> list[str]:
    """Have the worker do a request, and return the lines that it prints of it.

    Raises WorkError where it fails, ConnectionError where it is not there or dies.
    """
    address = _address(session)
    with (
        socket.create_connection(("127.0.0.1", address["port"])) as connection,
        connection.makefile("rw", encoding="utf-8") as stream,
    ):
        stream.write(json.dumps({**request, "word": address["word"]}) + "\n")
        stream.flush()
        with suppress(ConnectionError):
            for answer in map(json.loads, stream):
                if "fail" in answer:
                    raise WorkError(answer["fail"], answer["details"])
                if "done" in answer:
                    return answer["done"]
                show(answer["percent"], answer["text"])
    file = reading.read_last(session / NOTE)
    where = f"while it read {file}" if file else f"in the middle of it: {last_words(session)}"
    raise ConnectionResetError(f"Blender ended {where}")


def end(session: Path) -> None:
    """End the worker of a session, if there is one."""
    with suppress(ConnectionError, ProcessLookupError):
        os.kill(_address(session)["process"], signal.SIGTERM)
    (session / ADDRESS).unlink(missing_ok=True)


def last_words(session: Path) -> str:
    """Return the end of what a worker said, in one line."""
    with suppress(OSError):
        return " ".join((session / LOG).read_text(encoding="utf-8", errors="replace").split())[-LAST_WORDS:]
    return "it said nothing"


def _address(session: Path) -> dict[str, Any]:
    """Return where the worker of a session listens. Raises ConnectionError where there is none."""
    try:
        return json.loads((session / ADDRESS).read_bytes())
    except (OSError, ValueError):
        raise ConnectionError("there is no worker") from None
