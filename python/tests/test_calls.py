"""How calls run: without the interpreter's lock, with progress, until somebody interrupts them."""

from __future__ import annotations

import faulthandler
import gc
import os
import resource
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

import its
from conftest import torus

SHELL = its.build(*torus(), depth=6)
LONG: dict[str, Callable[..., Any]] = {
    "build": lambda **run: its.build(*torus(200, 100), depth=9, **run),
    "surface": lambda **run: SHELL.surface(resolution=200, **run),
    "verify": lambda **run: SHELL.verify(samples=300_000, **run),
    "simplify": lambda **run: its.simplify(torus(120, 60), tolerance=0.02, **run),
    "signed_distance": lambda **run: SHELL.signed_distance(np.zeros((300_000, 3)), **run),
    "classify": lambda **run: SHELL.classify(np.full((20_000_000, 3), 0.9), **run),
}


@pytest.mark.parametrize("name", LONG)
def test_progress_never_falls_and_ends_at_one(name: str) -> None:
    seen: list[tuple[str, float]] = []
    LONG[name](progress=lambda stage, fraction: seen.append((stage, fraction)))
    fractions = [fraction for _, fraction in seen]
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1
    assert all(isinstance(stage, str) and stage for stage, _ in seen)


@pytest.mark.parametrize("name", LONG)
def test_progress_may_cancel(name: str) -> None:
    with pytest.raises(its.Cancelled):
        LONG[name](progress=lambda stage, fraction: False)


@pytest.mark.parametrize("name", LONG)
def test_errors_of_progress_are_passed_on(name: str) -> None:
    def fail(stage: str, fraction: float) -> bool:
        raise LookupError("mine")

    with pytest.raises(LookupError, match="mine"):
        LONG[name](progress=fail)


def test_saying_no_at_the_end_cancels_too() -> None:
    with pytest.raises(its.Cancelled):
        SHELL.classify(np.zeros((5, 3)), progress=lambda stage, fraction: fraction < 1)


@pytest.fixture
def pythons_own_ctrl_c() -> Iterator[None]:
    """The handler of SIGINT that Python installs, which a parent process may have had ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


# Each takes days, but for Ctrl-C.
ENDLESS: dict[str, Callable[[], Any]] = {
    "verify": lambda: SHELL.verify(samples=10**13),
    "mesh_distance": lambda: its.mesh_distance(SHELL.mesh, SHELL.mesh, samples=10**13),
}


@pytest.mark.usefixtures("pythons_own_ctrl_c")
@pytest.mark.parametrize("name", ENDLESS)
def test_other_threads_go_on_and_ctrl_c_stops(name: str) -> None:
    def count_and_press() -> None:
        time.sleep(0.2)  # the call is under way
        for _ in range(20):
            time.sleep(0.001)
        os.kill(os.getpid(), signal.SIGINT)

    faulthandler.dump_traceback_later(120, exit=True)  # of a call that holds the lock, or does not look
    try:
        thread = threading.Thread(target=count_and_press)
        thread.start()
        with pytest.raises(KeyboardInterrupt):
            ENDLESS[name]()
        thread.join()
    finally:
        faulthandler.cancel_dump_traceback_later()


def test_calls_from_many_threads() -> None:
    points = np.random.default_rng(0).uniform(-1, 1, (5000, 3))
    expected = SHELL.signed_distance(points)
    shell = its.from_bytes(SHELL.to_bytes())  # whose search tree all threads want at once
    answers: list[Any] = [None] * 8

    def ask(i: int) -> None:
        answers[i] = shell.signed_distance(points, progress=lambda stage, fraction: None)

    threads = [threading.Thread(target=ask, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for answer in answers:
        np.testing.assert_array_equal(answer, expected)


def test_bar(capsys: pytest.CaptureFixture[str]) -> None:
    its.build(*torus(), depth=5, progress=True)
    shown = capsys.readouterr().err
    assert shown.endswith("\n")
    assert "100 %" in shown


def test_memory_does_not_grow() -> None:
    vertices, faces = torus(8, 6)
    points = np.zeros((100, 3))

    def work() -> None:
        SHELL.classify(points)
        SHELL.classify(points[0])
        SHELL.value([0, 0, 0])
        SHELL.closest(points)
        _ = SHELL.mesh.vertices[0]
        with pytest.raises(its.InputError):
            SHELL.classify([1])

    def build() -> None:
        its.build(vertices, faces, depth=2).surface()

    for call, times in ((work, 10_000), (build, 300)):
        for _ in range(times // 10):
            call()
        gc.collect()
        blocks, size = sys.getallocatedblocks(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in range(times):
            call()
        gc.collect()
        assert sys.getallocatedblocks() - blocks < times // 20
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - size < 20_000  # kB


SUBINTERPRETER = """
import os
import its
try:
    import _interpreters as interpreters
except ImportError:
    import _xxsubinterpreters as interpreters
try:
    raised = interpreters.run_string(interpreters.create(), "import its")
except Exception as error:  # until Python 3.12
    raised = error
print(raised, flush=True)
os._exit(0)  # what numpy leaves of the interpreter is nobody's to clean up
"""


def test_a_second_interpreter_is_refused() -> None:
    # In a process of its own: numpy's failed import alone may crash it later.
    done = subprocess.run([sys.executable, "-c", SUBINTERPRETER], capture_output=True, text=True, check=True)
    assert "ImportError" in done.stdout
    assert "module" in done.stdout
