"""Many meshes: one job on each, by any engine that has workers, resumable, whatever single meshes do."""

from __future__ import annotations

import fcntl
import functools
import hashlib
import json
import math
import os
import pickle
import queue
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass, field, fields
from html import escape
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any, Protocol, TypeAlias

from ._child import Children, run_isolated
from ._errors import Cancelled, Error, FileError, InputError, OptionError
from ._histogram import histogram
from ._html import table
from ._progress import ProgressLike, observer
from ._shell import build
from ._sizes import bytes_of, number, whole

#: What is done with each mesh: called with the path of the mesh's file and that of what it shall write,
#: which lacks an extension; returns numbers and words for the manifest, or None. It must be possible to
#: pickle it.
Job: TypeAlias = "Callable[[str, str], Mapping[str, Any] | None]"

_extensions = {".obj", ".stl", ".ply", ".off", ".glb", ".gltf", ".3mf"}
_in_flight = 256  # tasks that an engine is given before it has done any


class _Future(Protocol):
    def add_done_callback(self, fn: Callable[[Any], Any], /) -> Any: ...
    def result(self) -> Any: ...
    def cancel(self) -> Any: ...


class Engine(Protocol):
    """An executor of ``concurrent.futures``, or what is like it: Dask's ``Client.get_executor()``."""

    def submit(self, fn: Callable[..., Any], /, *args: Any) -> Any: ...


@dataclass(frozen=True)
class BuildJob:
    """Builds the shell of each mesh: TARGET.its. Options are those of :func:`its.build`."""

    thickness: float | None = None
    depth: int | None = None
    sign: str = "auto"
    max_cells: int | None = None
    max_depth: int | None = None
    weld: float | None = None
    turn_parts: bool | None = None
    strict: bool = False
    max_memory: int | str | None = None
    threads: int = 1

    def __call__(self, source: str, target: str) -> dict[str, Any]:
        """Writes the shell; what it is like."""
        shell = build(source, **{f.name: getattr(self, f.name) for f in fields(self)})
        shell.save(target + ".its", threads=self.threads)
        low, high = shell.bounds
        info = shell.info
        told = ("mesh_triangles", "sign", "depth", "thickness", "surface_cells", "coarse_cells", "memory_bytes")
        found = {name: info[name] for name in told}
        longest = float((high - low).max())
        found["relative_thickness"] = shell.thickness / longest if longest > 0 else None
        return found


@dataclass(frozen=True)
class Done:
    """A line of the manifest: what became of one mesh."""

    mesh: str  #: its path within the folder, or its file's name
    status: str  #: "done", "failed", "memory", "timeout", "crashed"
    seconds: float = 0.0
    peak_bytes: int | None = None  #: resident, of the process
    error: str | None = None
    warnings: list[str] = field(default_factory=list)  #: of Python, such as FileWarning and NotReachedWarning
    result: dict[str, Any] = field(default_factory=dict)  #: what the job returned
    size: int = 0  #: bytes of the mesh's file
    modified: int = 0  #: of the mesh's file, nanoseconds
    job: str = ""  #: that was done


@dataclass(frozen=True)
class BatchReport:
    """What became of all meshes, in their order."""

    meshes: list[Done]
    manifest: str
    resumed: int  #: that were done before
    seconds: float  #: of this call

    @property
    def counts(self) -> dict[str, int]:
        """How many meshes have each status."""
        return dict(Counter(done.status for done in self.meshes))

    @property
    def failures(self) -> list[Done]:
        """All that are not done."""
        return [done for done in self.meshes if done.status != "done"]

    def __str__(self) -> str:
        rows = self._rows()
        width = max(map(len, rows))
        lines = [f"{name:{width}}  {value}" for name, value in rows.items()]
        lines += [f"  {done.mesh}: {done.status}: {done.error}" for done in self.failures]
        return "\n".join(lines)

    def _rows(self) -> dict[str, object]:
        rows: dict[str, object] = {"meshes": f"{len(self.meshes):,}"}
        rows.update({name: f"{count:,}" for name, count in sorted(self.counts.items())})
        rows["done before"] = f"{self.resumed:,}"
        spent = sorted(done.seconds for done in self.meshes)
        if spent:
            rows["seconds a mesh"] = f"median {spent[len(spent) // 2]:.3g}, most {spent[-1]:.3g}"
        peaks = [done.peak_bytes for done in self.meshes if done.peak_bytes is not None]
        if peaks:
            rows["most memory"] = f"at most {max(peaks) / 1e6:,.0f} MB"
        rows["seconds"] = f"{self.seconds:.3g}"
        rows["manifest"] = self.manifest
        return rows

    def _repr_html_(self) -> str:
        failures = "".join(f"<li>{escape(f'{d.mesh}: {d.status}: {d.error}')}</li>" for d in self.failures)
        return table("Batch", self._rows()) + (f"<ul>{failures}</ul>" if failures else "") + self.picture()

    def picture(self) -> str:
        """Histograms as SVG: seconds, and each number that all that are done have."""
        done = [one for one in self.meshes if one.status == "done"]
        columns: dict[str, list[float]] = {"seconds": [one.seconds for one in done]}
        if all(one.peak_bytes for one in done):
            columns["peak_bytes"] = [float(one.peak_bytes or 0) for one in done]
        for name in done[0].result if done else ():
            values = [one.result.get(name) for one in done]
            numbers = [
                float(v)
                for v in values
                if isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v)
            ]
            if len(numbers) == len(done):
                columns[name] = numbers
        return histogram(columns)


def batch(
    meshes: str | os.PathLike[str] | Iterable[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    job: Job | None = None,
    *,
    executor: Engine | None = None,
    workers: int = 0,
    seconds: float | None = None,
    max_memory: int | str | None = None,
    retry: bool = False,
    progress: ProgressLike = None,
) -> BatchReport:
    """Does a job on each mesh; whatever happens to one of them, the others are done.

    Each job runs in a process beside its worker, which may be killed or crash. ``out/manifest.jsonl`` has a
    line for each mesh as soon as its job is over: called again, meshes that have one are left out, unless their
    file or the job has changed. So a run that was killed goes on where it was. ``summary.txt`` and
    ``summary.svg`` are written at the end.

    :param meshes: a folder, of which all mesh files are taken, those of its folders too; or paths
    :param out: a folder, made if need be: ``models/a.stl`` gives ``out/models/a.stl.its``
    :param job: default: :class:`BuildJob`
    :param executor: any engine with ``submit``, such as a ``ProcessPoolExecutor`` or Dask's; default: this
        process alone, with ``workers`` processes
    :param workers: without an executor; 0: as many as there are processors
    :param seconds: that each mesh may take; longer: "timeout"
    :param max_memory: bytes of address space that each mesh may take beside Python's own; more: "memory"
    :param retry: meshes whose job failed before are tried again
    :raises InputError: if there is no mesh, or two have the same name
    :raises FileError: if the folder cannot be written, or another run is at work in it
    :raises Cancelled: by ``progress``; the manifest has what is done
    :raises Error: if the engine fails; the manifest has what is done
    """
    found = list(_named(meshes, Path(out)))
    limit = None if seconds is None else number("seconds", seconds)
    if limit is not None and not limit > 0:
        raise OptionError(f"seconds {limit:g}: must be more than 0")
    job = BuildJob() if job is None else job
    plan = _Plan(job, _identity(job), Path(out), limit, bytes_of(max_memory))
    with _Manifest(plan.out / "manifest.jsonl") as manifest:
        return _run(found, plan, manifest, executor, whole("workers", workers), retry, observer(progress))


@dataclass(frozen=True)
class _Plan:
    job: Job
    identity: str
    out: Path
    seconds: float | None
    max_memory: int | None

    def task(self, source: Path, name: str) -> dict[str, Any]:
        return {
            "job": self.payload,
            "preparation": self.preparation,
            "source": str(source),
            "target": str((self.out / name).absolute()),
            "max_memory": self.max_memory,
        }

    @functools.cached_property
    def payload(self) -> bytes:
        try:
            import cloudpickle

            return bytes(cloudpickle.dumps(self.job))
        except ImportError:
            pass
        try:
            return pickle.dumps(self.job)
        except (pickle.PicklingError, AttributeError, TypeError) as error:
            raise OptionError(
                f"job: it cannot be pickled ({error}); define it in a module, or install cloudpickle"
            ) from error

    @functools.cached_property
    def preparation(self) -> dict[str, Any]:
        """How a process finds the main module, where the job may be from."""
        from multiprocessing import spawn

        if getattr(self.job, "__module__", "") != "__main__" or "cloudpickle" in sys.modules:
            return {}
        data = spawn.get_preparation_data("its.batch")
        return {key: data[key] for key in ("init_main_from_name", "init_main_from_path") if key in data}

    def line(self, name: str, source: Path, found: Mapping[str, Any]) -> Done:
        size, modified = _stamp(source)
        return Done(mesh=name, size=size, modified=modified, job=self.identity, **found)

    def is_done(self, line: Done | None, source: Path, retry: bool) -> bool:
        if line is None or line.job != self.identity or (line.size, line.modified) != _stamp(source):
            return False
        return line.status == "done" or not retry


def _stamp(path: Path) -> tuple[int, int]:
    """Size and time; zeros if there is no such file, which the job will say."""
    try:
        status = path.stat()
    except OSError:
        return 0, 0
    return status.st_size, status.st_mtime_ns


def _named(
    meshes: str | os.PathLike[str] | Iterable[str | os.PathLike[str]], out: Path
) -> Iterator[tuple[str, Path]]:
    """Names within the output, and absolute paths. What is in the output is no mesh of the folder."""
    if isinstance(meshes, str | os.PathLike):
        folder = Path(meshes)
        if not folder.is_dir():
            raise InputError(f"{folder}: there is no such folder; give a list for single files")
        results = out.resolve()
        if results == folder.resolve():
            raise OptionError(
                f"{folder}: results need a folder of their own, or the next run would take them in"
            )
        files = sorted(
            path
            for path in folder.rglob("*")
            if path.suffix.lower() in _extensions
            and not path.is_dir()
            and not path.parent.resolve().is_relative_to(results)
        )
        pairs = [(str(file.relative_to(folder)), file.absolute()) for file in files]
    else:
        pairs = [(Path(path).name, Path(path).absolute()) for path in meshes]
    if not pairs:
        raise InputError("batch: there are no meshes")
    twice = [name for name, count in Counter(name for name, _ in pairs).items() if count > 1]
    if twice:
        raise InputError(f"batch: two meshes are called {twice[0]}; give their folder instead, or rename one")
    yield from pairs


def _identity(job: Any) -> str:
    """The same for the same job in another process, not where its code or anything in it has changed."""
    if isinstance(job, BuildJob):
        return repr(job)
    seen = hashlib.sha256()
    _add(job, seen)
    name = getattr(job, "__qualname__", type(job).__qualname__)
    return f"{getattr(job, '__module__', '')}.{name}:{seen.hexdigest()[:16]}"


def _add(value: Any, seen: hashlib._Hash) -> None:
    """Code by what it does, data by what it is."""
    if isinstance(value, functools.partial):
        for part in (value.func, value.args, sorted(value.keywords.items())):
            _add(part, seen)
    elif isinstance(value, FunctionType):
        _add(value.__code__, seen)
        _add(value.__defaults__, seen)
        _add(value.__kwdefaults__, seen)
        for cell in value.__closure__ or ():
            _add(cell.cell_contents, seen)
    elif isinstance(value, CodeType):
        seen.update(value.co_code)
        for part in (value.co_names, value.co_consts):
            _add(part, seen)
    elif isinstance(value, tuple | list):
        seen.update(b"(")
        for part in value:
            _add(part, seen)
        seen.update(b")")
    else:
        try:
            seen.update(pickle.dumps(value, protocol=4))
        except (pickle.PicklingError, AttributeError, TypeError):
            seen.update(repr(value).encode())  # perhaps with an address: then all is done anew


def _plain(value: Any) -> Any:
    """As JSON has it, which knows no NaN and no infinity: they become words."""
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    if isinstance(value, dict):
        return {str(name): _plain(item) for name, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return value


class _Manifest:
    """Lines of JSON, one a mesh, the last of a mesh counts. Only one run at a time has it."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lines: dict[str, Done] = {}

    def __enter__(self) -> _Manifest:
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise FileError(f"{self.path.parent}: this folder cannot be made: {error.strerror}") from error
        try:
            self._file = open(self.path, "a+b")
        except OSError as error:
            raise FileError(f"{self.path}: {error.strerror}") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            self._file.close()
            raise FileError(f"{self.path}: another run is at work in this folder") from error
        self._read()
        return self

    def __exit__(self, *_: object) -> None:
        self._file.close()

    def _read(self) -> None:
        """A run that was killed may have left half a line: it is cut off."""
        self._file.seek(0)
        text = self._file.read()
        whole_lines = text[: text.rfind(b"\n") + 1]
        if len(whole_lines) < len(text):
            self._file.truncate(len(whole_lines))
        names = {f.name for f in fields(Done)}
        for at, line in enumerate(whole_lines.splitlines(), 1):
            try:
                values = json.loads(line)
                done = Done(**{name: value for name, value in values.items() if name in names})
            except (ValueError, TypeError, AttributeError) as error:
                self._file.close()
                raise FileError(f"{self.path}: line {at} is none of a manifest: {error}") from error
            self.lines[done.mesh] = done

    def add(self, done: Done) -> None:
        self.lines[done.mesh] = done
        values = {name: value for name, value in asdict(done).items() if value not in (None, [], {})}
        self._file.write(json.dumps(_plain(values), default=str).encode() + b"\n")
        self._file.flush()


def _run(
    meshes: list[tuple[str, Path]],
    plan: _Plan,
    manifest: _Manifest,
    executor: Engine | None,
    workers: int,
    retry: bool,
    watch: Any,
) -> BatchReport:
    start = time.monotonic()
    left = [pair for pair in meshes if not plan.is_done(manifest.lines.get(pair[0]), pair[1], retry)]
    resumed = len(meshes) - len(left)
    if executor is not None:
        _feed(executor, run_isolated, left, plan, manifest, len(meshes), watch)
    elif left:
        if workers < 0:
            raise OptionError(f"workers {workers}: must be 0 or more")
        children = Children()
        with ThreadPoolExecutor(workers or os.cpu_count() or 1, "its.batch") as own:
            try:
                _feed(own, children.run, left, plan, manifest, len(meshes), watch)
            finally:
                children.end()
    report = BatchReport(
        [manifest.lines[name] for name, _ in meshes], str(manifest.path), resumed, time.monotonic() - start
    )
    (plan.out / "summary.txt").write_text(f"{report}\n", encoding="utf-8")
    (plan.out / "summary.svg").write_text(report.picture(), encoding="utf-8")
    return report


def _feed(
    executor: Engine,
    run: Callable[..., dict[str, Any]],
    left: list[tuple[str, Path]],
    plan: _Plan,
    manifest: _Manifest,
    count: int,
    watch: Any,
) -> None:
    """Keeps some tasks with the engine, and writes down what comes back."""
    finished: queue.SimpleQueue[_Future] = queue.SimpleQueue()
    flying: dict[_Future, tuple[str, Path]] = {}
    waiting = iter(left)

    def submit() -> bool:
        pair = next(waiting, None)
        if pair is None:
            return False
        future: _Future = executor.submit(run, plan.task(pair[1], pair[0]), plan.seconds)
        flying[future] = pair
        future.add_done_callback(finished.put)
        return True

    try:
        while len(flying) < _in_flight and submit():
            pass
        done = count - len(left)
        while flying:
            future = finished.get()
            name, source = flying.pop(future)
            manifest.add(plan.line(name, source, future.result()))
            done += 1
            submit()
            if watch is not None and not watch("batch", done / count):
                raise Cancelled("stopped by the caller")
    except Error:
        raise
    except Exception as error:
        raise Error(
            f"batch: the engine failed ({type(error).__name__}: {error}); what is done is in the manifest: "
            "call it again with a working one to go on"
        ) from error
    finally:
        for future in flying:
            future.cancel()
