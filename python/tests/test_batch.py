"""Batches: whatever single meshes do, the others are done, and a run that was ended goes on where it was."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import its
from conftest import cube, torus


def obey(source: str, target: str, extra: int = 0) -> dict[str, Any]:
    """Does what the file says."""
    word = Path(source).read_text()
    if word == "crash":
        os.kill(os.getpid(), signal.SIGKILL)
    if word == "sleep":
        time.sleep(1000)
    if word == "eat":
        bytearray(10**9)
    if word == "fail":
        raise ValueError("as it was told")
    if word == "slow":
        time.sleep(0.3)
    Path(target + ".txt").write_text(word)
    return {"letters": len(word) + extra, "parent": os.getppid()}


def write(folder: Path, **words: str) -> Path:
    folder.mkdir(exist_ok=True)
    for name, word in words.items():
        (folder / f"{name}.obj").write_text(word)
    return folder


def test_nothing_stops_the_others(tmp_path: Path) -> None:
    bad = {"a": "crash", "b": "sleep", "c": "eat", "d": "fail"}
    good = {f"m{i}": "go" for i in range(20)}
    folder = write(tmp_path / "in", **bad, **good)
    report = its.batch(folder, tmp_path / "out", obey, workers=2, seconds=3, max_memory="300M")
    found = {done.mesh: done.status for done in report.meshes}
    assert [found[f"{name}.obj"] for name in "abcd"] == ["crashed", "timeout", "memory", "failed"]
    assert all(found[f"{name}.obj"] == "done" for name in good)
    assert report.counts["done"] == 20
    assert {one.mesh: one.error for one in report.failures}["d.obj"] == "ValueError: as it was told"
    assert "SIGKILL" in str(report)
    assert (tmp_path / "out" / "summary.txt").read_text() == f"{report}\n"
    assert (tmp_path / "out" / "summary.svg").read_text().count("<title>") >= 24
    assert "<svg" in report._repr_html_()
    assert all(done.result["letters"] == 2 for done in report.meshes if done.status == "done")


def test_only_what_is_not_done_is_done(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", a="go", b="fail", c="go"), tmp_path / "out"
    assert its.batch(folder, out, obey).resumed == 0
    assert its.batch(folder, out, obey).resumed == 3
    assert its.batch(folder, out, obey, retry=True).resumed == 2
    write(folder, b="better", c="changed")
    again = its.batch(folder, out, obey)
    assert again.resumed == 1
    assert again.counts == {"done": 3}
    assert (out / "c.obj.txt").read_text() == "changed"
    assert its.batch(folder, out, partial(obey, extra=1)).resumed == 0  # another job
    assert its.batch(folder, out, partial(obey, extra=1)).resumed == 3


def test_half_a_line_is_cut_off(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", a="go", b="go"), tmp_path / "out"
    its.batch(folder, out, obey, workers=1)
    manifest = out / "manifest.jsonl"
    text = manifest.read_bytes()
    for keep in range(len(text)):
        manifest.write_bytes(text[:keep])
        lines = text[:keep].count(b"\n")
        with its._batch._Manifest(manifest) as opened:
            assert len(opened.lines) == lines
        assert manifest.read_bytes().count(b"\n") == lines
    manifest.write_bytes(b"{}\n")
    with pytest.raises(its.FileError, match="line 1"):
        its.batch(folder, out, obey)


SCHEDULER = """
import sys
import its
from test_batch import obey
if __name__ == "__main__":
    its.batch(sys.argv[1], sys.argv[2], obey, workers=2)
"""


def test_a_killed_scheduler_is_taken_up(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", **{f"m{i:02}": "slow" for i in range(12)}), tmp_path / "out"
    here = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    first = subprocess.Popen([sys.executable, "-c", SCHEDULER, str(folder), str(out)], env=here)
    manifest = out / "manifest.jsonl"
    while not manifest.exists() or manifest.read_bytes().count(b"\n") < 3:
        assert first.poll() is None
        time.sleep(0.02)
    with pytest.raises(its.FileError, match="another run"):
        its.batch(folder, out, obey)
    first.kill()
    first.wait()
    report = its.batch(folder, out, obey, workers=2)
    assert 3 <= report.resumed < 12
    assert report.counts == {"done": 12}


def alive(pid: int) -> bool:
    """Whether there is such a process that has not ended."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def report_child(source: str, target: str) -> None:
    Path(target + ".pid").write_text(str(os.getpid()))
    time.sleep(1000)


def test_children_end_with_their_worker(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", a="go"), tmp_path / "out"
    here = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    code = SCHEDULER.replace("obey", "report_child")
    worker = subprocess.Popen([sys.executable, "-c", code, str(folder), str(out)], env=here)
    pid = out / "a.obj.pid"
    while not pid.exists() or not pid.read_text():
        assert worker.poll() is None
        time.sleep(0.02)
    child = int(pid.read_text())
    assert alive(child)
    worker.kill()
    worker.wait()
    for _ in range(500):
        if not alive(child):
            break
        time.sleep(0.02)
    assert not alive(child)


@pytest.mark.parametrize("engine", [ThreadPoolExecutor, ProcessPoolExecutor])
def test_engines_of_the_standard_library(tmp_path: Path, engine: type[Executor]) -> None:
    folder = write(tmp_path / "in", a="crash", b="fail", **{f"m{i}": "go" for i in range(10)})
    with engine(2) as executor:  # type: ignore[call-arg]
        report = its.batch(folder, tmp_path / "out", obey, executor=executor)
    assert report.counts == {"done": 10, "crashed": 1, "failed": 1}
    workers = {done.result["parent"] for done in report.meshes if done.status == "done"}
    assert (os.getpid() in workers) == (engine is ThreadPoolExecutor)


def die(*_: Any) -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def test_an_engine_that_fails_is_said(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", **{f"m{i}": "slow" for i in range(6)}), tmp_path / "out"
    with ProcessPoolExecutor(1) as pool:
        pool.submit(die)
        with pytest.raises(its.Error, match="engine failed"):
            its.batch(folder, out, obey, executor=pool)
    assert its.batch(folder, out, obey).counts == {"done": 6}


def test_a_cluster_of_dask(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    folder = write(tmp_path / "in", a="crash", b="fail", **{f"m{i}": "go" for i in range(30)})
    quiet = {"dashboard_address": None, "silence_logs": 50}
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **quiet) as cluster,
        distributed.Client(cluster) as client,
    ):
        report = its.batch(folder, tmp_path / "out", obey, executor=client.get_executor())
        assert report.counts == {"done": 30, "crashed": 1, "failed": 1}
        assert os.getpid() not in {done.result.get("parent") for done in report.meshes}
        nearby = its.batch(folder, tmp_path / "out2", lambda source, target: {"n": 1}, executor=client)
        assert nearby.counts == {"done": 32}


def test_a_worker_of_dask_may_be_killed(tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    folder = write(tmp_path / "in", **{f"m{i:02}": "slow" for i in range(16)})
    killed: list[int] = []

    def kill_one(stage: str, fraction: float) -> None:
        if not killed:
            workers = client.run(os.getpid)
            killed.append(next(iter(workers.values())))
            os.kill(killed[0], signal.SIGKILL)

    quiet = {"dashboard_address": None, "silence_logs": 50}
    with (
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, **quiet) as cluster,
        distributed.Client(cluster) as client,
    ):
        report = its.batch(folder, tmp_path / "out", obey, executor=client.get_executor(), progress=kill_one)
    assert killed
    assert report.counts == {"done": 16}


def test_shells_of_a_folder(tmp_path: Path) -> None:
    folder = tmp_path / "models"
    (folder / "round").mkdir(parents=True)
    its.write(folder / "cube.obj", cube())
    its.write(folder / "round" / "torus.ply", torus())
    (folder / "bad.stl").write_text("solid nothing\nendsolid\n")
    (folder / "notes.txt").write_text("no mesh")
    report = its.batch(folder, tmp_path / "out", its.BuildJob(thickness=0.05))
    assert [done.mesh for done in report.meshes] == ["bad.stl", "cube.obj", "round/torus.ply"]
    assert [done.status for done in report.meshes] == ["failed", "done", "done"]
    shell = its.load(tmp_path / "out" / "round" / "torus.ply.its")
    assert shell == its.build(*torus(), thickness=0.05)
    lines = [json.loads(line) for line in (tmp_path / "out" / "manifest.jsonl").read_text().splitlines()]
    assert {line["mesh"] for line in lines} == {"bad.stl", "cube.obj", "round/torus.ply"}
    assert report.meshes[2].result["thickness"] == shell.thickness


def test_progress_may_stop_it(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", **{f"m{i:02}": "go" for i in range(30)}, z="sleep"), tmp_path / "out"
    with pytest.raises(its.Cancelled):
        its.batch(folder, out, obey, workers=2, progress=lambda stage, fraction: fraction < 0.5)
    (folder / "z.obj").unlink()
    report = its.batch(folder, out, obey)
    assert report.resumed >= 15
    assert report.counts == {"done": 30}


def test_what_cannot_be_done(tmp_path: Path) -> None:
    folder = write(tmp_path / "in", a="go")
    with pytest.raises(its.InputError, match="no such folder"):
        its.batch(tmp_path / "nowhere", tmp_path / "out", obey)
    with pytest.raises(its.InputError, match="no meshes"):
        its.batch([], tmp_path / "out", obey)
    with pytest.raises(its.InputError, match="two meshes"):
        its.batch([folder / "a.obj", tmp_path / "a.obj"], tmp_path / "out", obey)
    with pytest.raises(its.FileError):
        its.batch(folder, folder / "a.obj", obey)
    for options in ({"seconds": 0}, {"seconds": "x"}, {"workers": -1}, {"workers": 1.5}, {"max_memory": "x"}):
        with pytest.raises(its.OptionError):
            its.batch(folder, tmp_path / "out", obey, **options)
    gone = its.batch([folder / "b.obj"], tmp_path / "out", obey)
    assert gone.meshes[0].status == "failed"
    assert "FileNotFoundError" in str(gone)


def test_another_lambda_is_another_job(tmp_path: Path) -> None:
    pytest.importorskip("cloudpickle")
    folder, out = write(tmp_path / "in", a="go"), tmp_path / "out"

    def job(n: int) -> Any:
        return lambda source, target: {"n": n}

    for n in (1, 2):
        assert its.batch(folder, out, job(n)).meshes[0].result == {"n": n}
        assert its.batch(folder, out, job(n)).resumed == 1
    assert its.batch(folder, out, lambda source, target: {"n": 1 + 1}).resumed == 0
    assert its.batch(folder, out, lambda source, target: {"n": 3}).resumed == 0
    assert its.batch(folder, out, partial(obey, extra=7)).meshes[0].result["letters"] == 9


def test_batches_at_once_do_not_know_each_other(tmp_path: Path) -> None:
    quick, slow = (
        write(tmp_path / "quick", a="go"),
        write(tmp_path / "slow", **{f"m{i}": "slow" for i in range(8)}),
    )
    with ThreadPoolExecutor() as threads:
        other = threads.submit(its.batch, slow, tmp_path / "out", obey, workers=2)
        for i in range(5):
            assert its.batch(quick, tmp_path / f"quick{i}", obey).counts == {"done": 1}
        assert other.result().counts == {"done": 8}


def odd_numbers(source: str, target: str) -> dict[str, Any]:
    return {"nan": float("nan"), "list": [float("inf"), 1.5], "one": 1.0}


def quit_early(source: str, target: str) -> None:
    sys.exit(3)


def test_results_that_are_no_numbers(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", a="go", b="go"), tmp_path / "out"
    for _ in range(2):
        report = its.batch(folder, out, odd_numbers)
        assert report.counts == {"done": 2}
    lines = (out / "manifest.jsonl").read_text().splitlines()

    def refuse(name: str) -> None:
        raise ValueError(name)

    assert json.loads(lines[0], parse_constant=refuse)["result"] == {
        "nan": "nan",
        "list": ["inf", 1.5],
        "one": 1.0,
    }
    assert its.batch(folder, out, quit_early).meshes[0].error == "SystemExit: 3"


def test_results_are_no_input(tmp_path: Path) -> None:
    folder = write(tmp_path / "in", a="go")
    (folder / "link.obj").symlink_to(folder / "a.obj")
    (folder / "broken.obj").symlink_to(folder / "nowhere")
    write(folder / "results", old="go")
    report = its.batch(folder, folder / "results", obey)
    assert [done.mesh for done in report.meshes] == ["a.obj", "broken.obj", "link.obj"]
    assert report.counts == {"done": 2, "failed": 1}
    with pytest.raises(its.OptionError, match="folder of their own"):
        its.batch(folder, folder, obey)


def test_what_stands_in_the_way_of_one_is_its_own(tmp_path: Path) -> None:
    folder, out = write(tmp_path / "in", a="go"), tmp_path / "out"
    write(folder / "deep", b="go")
    out.mkdir()
    (out / "deep").write_text("a file where a folder is needed")
    report = its.batch(folder, out, obey)
    assert {done.mesh: done.status for done in report.meshes} == {"a.obj": "done", "deep/b.obj": "failed"}
