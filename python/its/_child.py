"""A process beside the worker, in which jobs run.

It may be killed, crash or run out of memory, and nothing else is lost. One runs many jobs, so that starting it
costs little a mesh.

Frames go both ways: eight bytes of length, then a pickle. The child ends when its end of the pipe is closed,
whatever ended the other: it never outlives the worker, nor goes on with a job of one that was killed.
"""

from __future__ import annotations

import contextlib
import os
import pickle
import queue
import resource
import select
import signal
import struct
import subprocess
import sys
import threading
import time
import warnings
from typing import IO, Any

_length = struct.Struct("<Q")


def _send(pipe: IO[bytes], frame: object) -> None:
    data = pickle.dumps(frame)
    pipe.write(_length.pack(len(data)) + data)
    pipe.flush()


def _exactly(fd: int, count: int, deadline: float | None) -> bytes:
    """Raises EOFError at the end, TimeoutError at the deadline."""
    parts = []
    while count:
        if deadline is not None:
            left = deadline - time.monotonic()
            if left <= 0 or not select.select([fd], [], [], left)[0]:
                raise TimeoutError
        part = os.read(fd, min(count, 1 << 20))
        if not part:
            raise EOFError
        parts.append(part)
        count -= len(part)
    return b"".join(parts)


def _receive(fd: int, deadline: float | None = None) -> Any:
    (length,) = _length.unpack(_exactly(fd, _length.size, deadline))
    return pickle.loads(_exactly(fd, length, deadline))


class Child:
    """The worker's side."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-c", "from its._child import main; main()"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._to, self._from = self._process.stdin, self._process.stdout.fileno()

    def run(self, task: dict[str, Any], seconds: float | None) -> dict[str, Any]:
        """What became of the task. Afterwards the child may be gone."""
        start = time.monotonic()
        try:
            _send(self._to, task)
            found: dict[str, Any] = _receive(self._from, None if seconds is None else start + seconds)
        except TimeoutError:
            self.kill()
            self._close()
            found = {"status": "timeout", "error": f"took longer than {seconds:g} s"}
        except (EOFError, BrokenPipeError):
            found = {"status": "crashed", "error": f"the process ended: {_cause(self._close())}"}
        return {"seconds": round(time.monotonic() - start, 6), **found}

    @property
    def alive(self) -> bool:
        return self._process.poll() is None

    def kill(self) -> None:
        self._process.kill()

    def _close(self) -> int:
        """Of one that is ending: its status."""
        with contextlib.suppress(BrokenPipeError):
            self._to.close()
        assert self._process.stdout
        self._process.stdout.close()
        return self._process.wait()


def _cause(code: int) -> str:
    return f"exit status {code}" if code >= 0 else f"signal {signal.Signals(-code).name}"


class Children:
    """Those of a worker, or of one batch: a task takes one that is idle, or a new one."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._idle: list[Child] = []
        self._busy: set[Child] = set()
        self._ended = False

    def run(self, task: dict[str, Any], seconds: float | None) -> dict[str, Any]:
        """In any thread. What became of the task."""
        with self._lock:
            if self._ended:
                return {"status": "crashed", "error": "the batch was ended"}
            child = self._idle.pop() if self._idle else None
            if child is None or not child.alive:
                child = Child()
            self._busy.add(child)
        try:
            return child.run(task, seconds)
        finally:
            with self._lock:
                self._busy.remove(child)
                if child.alive:
                    self._idle.append(child)

    def end(self) -> None:
        """Kills them, whatever they do."""
        with self._lock:
            self._ended = True
            for child in (*self._idle, *self._busy):
                child.kill()
            self._idle.clear()


_of_worker = Children()


def run_isolated(task: dict[str, Any], seconds: float | None) -> dict[str, Any]:
    """On a worker of any kind, in any of its threads."""
    return _of_worker.run(task, seconds)


# The child's side.


def _limit(size: int | None) -> None:
    """Lets this process take so many more bytes of address space than it has, or any number."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    soft = hard
    if size is not None:
        with open("/proc/self/statm") as file:
            now = int(file.read().split()[0]) * resource.getpagesize()
        soft = now + size if hard == resource.RLIM_INFINITY else min(now + size, hard)
    resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


def _reset_peak() -> None:
    with contextlib.suppress(OSError), open("/proc/self/clear_refs", "w") as file:
        file.write("5")


def _peak() -> int | None:
    with contextlib.suppress(OSError), open("/proc/self/status") as file:
        for line in file:
            if line.startswith("VmHWM:"):
                return 1024 * int(line.split()[1])
    return None


def _perform(job: Any, task: dict[str, Any]) -> dict[str, Any]:
    _reset_peak()
    found: dict[str, Any]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        found = _outcome(job, task)
    if said:
        found["warnings"] = [str(warning.message) for warning in said]
    return {**found, "peak_bytes": _peak()}


def _outcome(job: Any, task: dict[str, Any]) -> dict[str, Any]:
    try:
        os.makedirs(os.path.dirname(task["target"]), exist_ok=True)
        _limit(task["max_memory"])
        return {"status": "done", "result": dict(job(task["source"], task["target"]) or {})}
    except MemoryError as error:
        return {"status": "memory", "error": str(error) or "no more memory"}
    except BaseException as error:  # of any kind, sys.exit() too: it is the mesh's, and told
        return {"status": "failed", "error": f"{type(error).__name__}: {error}"}
    finally:
        _limit(None)


def main() -> None:
    """Runs the jobs that are sent until the pipe ends, which a thread of its own watches."""
    from multiprocessing import spawn

    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the worker's terminal is not for us
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what jobs print is no frame
    tasks: queue.SimpleQueue[Any] = queue.SimpleQueue()

    def watch() -> None:
        try:
            while True:
                tasks.put(_receive(0))
        except EOFError:
            os._exit(0)

    threading.Thread(target=watch, daemon=True).start()
    payload, job = b"", None
    while True:
        task = tasks.get()
        try:
            if task["job"] != payload:
                spawn.prepare(task["preparation"])  # the main module, where the job may be from
                job, payload = pickle.loads(task["job"]), task["job"]
            found = _perform(job, task)
        except Exception as error:
            found = {
                "status": "failed",
                "error": f"the job cannot be unpickled: {type(error).__name__}: {error}",
            }
        try:
            _send(answers, found)
        except (TypeError, AttributeError, pickle.PicklingError) as error:
            _send(answers, {"status": "failed", "error": f"the job's result cannot be sent: {error}"})
