"""Batches on a Dask cluster: the side of the client."""

from __future__ import annotations

import io
import json
import os
import queue
import tarfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Callable, Iterable, Iterator

from facemill import _facemill
from facemill._facemill import Error
from facemill.batch import _worker
from facemill.batch._expand import MAX_TASKS, allowed, expand

if TYPE_CHECKING:
    from distributed import Client, Future

#: Time between looks at the scheduler, s.
_LOOK = 0.5

#: Time between looks at the number of workers, s.
_COUNT = 10.0

#: Chunks at the scheduler for each thread of the workers.
_AHEAD = 8

#: Least number of chunks at the scheduler.
_LEAST_AHEAD = 64


#: Message of a run whose scheduler ended.
_GONE = "the scheduler is gone; results so far are kept, and the same call goes on with another one"


@dataclass
class Summary:
    """End of a run."""

    #: Number of tasks of the batch; those of one key count once.
    tasks: int
    #: Number of them with a result or a final failure before.
    already: int
    #: Exit codes of the tasks with a result, by key.
    exit_codes: dict[str, int] = field(default_factory=dict)
    #: Causes of failures, by key.
    failures: dict[str, str] = field(default_factory=dict)
    #: Keys of the failures that wrong input causes.
    wrong_input: set[str] = field(default_factory=set)

    @property
    def exit_code(self) -> int:
        """Exit code that ``facemill batch run`` has: 0, 1 or 3."""
        if len(self.exit_codes) + len(self.failures) < self.tasks or set(self.failures) - self.wrong_input:
            return 3
        return 1 if self.failures or any(self.exit_codes.values()) else 0


def run(
    batch: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    scheduler: str | Client | None = None,
    *,
    chunk: int = 1,
    threads: int = 1,
    retries: int = 0,
    max_memory: int | None = None,
    retry_failed: bool = False,
    shared: bool = False,
    allow: Iterable[str | os.PathLike[str]] = (),
    allow_outside: bool = False,
    max_tasks: int = MAX_TASKS,
    patience: float = 30.0,
    on_end: Callable[[dict[str, Any], int | None], None] | None = None,
) -> Summary:
    """Runs the tasks of a batch that have no result yet on a Dask cluster.

    The folder of results is that of ``facemill batch run``, with the same bytes, and each of both
    goes on where the other ended. Each result is checked against its key, and renamed into its
    place whole. Dask runs the tasks of a killed worker again; if the scheduler ends, so does the
    run with an :class:`Error`, and the same call goes on with another scheduler.

    :param batch: batch file.
    :param out: folder of the results; default: ``out/`` and the name of the batch file.
    :param scheduler: address of the scheduler, such as ``"tcp://10.0.0.1:8786"``, or a client.
    :param chunk: tasks that are sent and answered together: more for many short tasks.
    :param threads: threads of each task. A worker runs as many tasks at once as it has threads.
    :param retries: tries after the first for tasks whose process is killed or out of memory.
    :param max_memory: bound of the address space of each task's process, MiB.
    :param retry_failed: also run tasks again whose input was wrong, and is the same.
    :param shared: the workers see batch and ``out`` at the same paths, and write the results
        there; by default inputs and results go through the scheduler, each input once to each
        worker that needs it.
    :param allow: folders besides its own in which jobs may name files.
    :param allow_outside: permit the batch and its jobs to name files anywhere.
    :param max_tasks: largest number of tasks.
    :param patience: time that the scheduler may be out of reach, s; of a client its own counts.
    :param on_end: called with each task and its exit code, or ``None`` for a failure.
    :raises Error: if the batch is wrong, a result cannot be written, or the scheduler is gone.
    """
    from distributed import Client

    if scheduler is None:
        raise Error("scheduler: give the address of a Dask scheduler, or a client")
    if chunk < 1 or threads < 1 or retries < 0:
        raise Error("chunk and threads: must be at least 1, and retries at least 0")
    path = Path(os.path.abspath(batch))
    folder = Path(os.path.abspath(out if out is not None else Path("out") / path.stem))
    allow = [os.path.abspath(name) for name in allow]
    listed = expand(path, allow=allow, allow_outside=allow_outside, max_tasks=max_tasks)
    _facemill.prepare_store(folder, path.read_bytes())
    waiting, summary = _waiting(listed, folder, retry_failed)
    if not waiting:
        return summary
    options = {
        "threads": threads,
        "retries": retries,
        "max_memory": max_memory,
        "shared_out": str(folder) if shared else None,
        "allow": allowed(path, allow, allow_outside) if shared else None,
    }
    chunks = _Chunks(waiting, chunk, options)
    client = scheduler if isinstance(scheduler, Client) else _client(scheduler, patience)
    try:
        _Submission(client, chunks, folder, summary, on_end).all()
    finally:
        if client is not scheduler:
            client.close(timeout=2)
    return summary


def _client(address: str, patience: float) -> Client:
    from distributed import Client

    try:
        return Client(address, timeout=patience, set_as_default=False)
    except (OSError, TimeoutError) as error:
        raise Error(f"no scheduler at {address}: {error}") from None


def _waiting(
    listed: list[dict[str, Any]], folder: Path, retry_failed: bool
) -> tuple[list[dict[str, Any]], Summary]:
    """Returns the tasks to be run, one of each key, and the ends of the others."""
    by_key = {task["key"]: task for task in reversed(listed)}
    tasks = sorted(by_key.values(), key=lambda task: task["number"])
    states = _facemill.stored(folder, [task["key"] for task in tasks])
    summary = Summary(tasks=len(tasks), already=0)
    waiting = []
    for task, state in zip(tasks, states):
        key = task["key"]
        if state is not None and state >= 0:
            summary.already += 1
            summary.exit_codes[key] = state
        elif task.get("unreadable") is not None:
            cause = task["unreadable"]
            failure = _worker._failure(key, _bare(task), 1)
            failure |= {"kind": "input", "cause": cause, "exit_code": 2}
            _facemill.file_failure(folder, key, json.dumps(failure).encode())
            summary.failures[key] = cause
            summary.wrong_input.add(key)
        elif state is not None and not retry_failed:
            summary.already += 1
            failure = json.loads((folder / "failed" / f"{key}.json").read_bytes())
            summary.failures[key] = failure["cause"]
            summary.wrong_input.add(key)
        else:
            waiting.append(task)
    return waiting, summary


def _bare(listed: dict[str, Any]) -> dict[str, Any]:
    """Returns a task without what the list adds."""
    return {name: value for name, value in listed.items() if name not in ("key", "inputs", "unreadable")}


class _Chunks:
    """Tasks in chunks, as text, with the input files of each."""

    def __init__(self, tasks: list[dict[str, Any]], size: int, options: dict[str, Any]) -> None:
        self._tasks = tasks
        self._size = size
        self._options = options
        #: Paths of input files by checksum.
        self._paths: dict[str, Path] = {}

    def __iter__(self) -> Iterator[tuple[str, list[dict[str, Any]], list[str]]]:
        for k in range(0, len(self._tasks), self._size):
            tasks = self._tasks[k : k + self._size]
            items = [self._item(task) for task in tasks]
            names = {name for item in items for name in item.get("tree", {}).values()}
            text = json.dumps({**self._options, "tasks": items}, sort_keys=True)
            yield text, tasks, sorted(names)

    def _item(self, listed: dict[str, Any]) -> dict[str, Any]:
        """Returns what a worker has to know of a task."""
        task = _bare(listed)
        item: dict[str, Any] = {"key": listed["key"], "task": task}
        if self._options["shared_out"] is not None:
            return item
        job = Path(os.path.abspath(task["job"]))
        files = {os.path.normpath(entry["file"]): entry["blake3"] for entry in listed["inputs"]}
        for name in files:
            if os.path.isabs(name):
                raise Error(f"{job}: names {name} by an absolute path, which workers do not have: run with shared=True")
        # As many folders around the job as its files lead out of its own.
        depth = max((Path(name).parts.count(os.pardir) for name in files), default=0)
        inside = "/".join(["d"] * depth)
        tree = {}
        for name, checksum in files.items():
            tree[os.path.normpath(os.path.join(inside, name))] = checksum
            self._paths.setdefault(checksum, job.parent / name)
        item["job"] = os.path.join(inside, job.name)
        item["program"] = None
        if task["program"] is not None:
            program = Path(os.path.abspath(task["program"]))
            checksum = _facemill.checksum(program.read_bytes())
            self._paths.setdefault(checksum, program)
            # In a folder of its own: no file of the job has its place.
            item["program"] = os.path.join("program", program.name)
            tree[item["program"]] = checksum
        item["tree"] = tree
        return item

    def content(self, checksum: str) -> bytes:
        """Returns an input file.

        :raises Error: if it has changed since the batch was expanded.
        """
        path = self._paths[checksum]
        content = path.read_bytes()
        if _facemill.checksum(content) != checksum:
            raise Error(f"{path}: changed while the batch ran; run the batch again")
        return content


class _Submission:
    """Chunks at a scheduler, and their results."""

    def __init__(
        self,
        client: Client,
        chunks: _Chunks,
        folder: Path,
        summary: Summary,
        on_end: Callable[[dict[str, Any], int | None], None] | None,
    ) -> None:
        self._client = client
        self._chunks = chunks
        self._folder = folder
        self._summary = summary
        self._on_end = on_end
        self._inputs: dict[str, Future] = {}
        self._at_work: dict[str, tuple[Future, list[dict[str, Any]]]] = {}
        self._ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self._threads = 0
        self._counted = -_COUNT

    def all(self) -> None:
        """Submits all chunks, some ahead of the workers, and files their results."""
        try:
            self._submit_all()
        except Error:
            raise
        except Exception as error:
            # Calls of a client fail in many ways when its scheduler ends.
            if self._client.status == "running":
                raise
            raise Error(_GONE) from error
        finally:
            # The scheduler forgets them.
            self._at_work.clear()
            self._inputs.clear()

    def _submit_all(self) -> None:
        left = iter(self._chunks)
        more = True
        while more or self._at_work:
            ahead = self._ahead()
            while more and len(self._at_work) < ahead:
                following = next(left, None)
                if following is None:
                    more = False
                else:
                    self._submit(*following)
            self._take()

    def _ahead(self) -> int:
        """Returns the number of chunks that the scheduler is to have."""
        if time.monotonic() - self._counted >= _COUNT and self._client.status == "running":
            workers = self._client.scheduler_info(n_workers=-1).get("workers", {}).values()
            self._threads = sum(worker["nthreads"] for worker in workers)
            self._counted = time.monotonic()
        return max(_LEAST_AHEAD, _AHEAD * self._threads)

    def _submit(self, text: str, tasks: list[dict[str, Any]], names: list[str]) -> None:
        for name in names:
            if name not in self._inputs:
                # A task, and no scattered value: if its worker is killed, Dask computes it again.
                key = f"facemill-input-{name}"
                self._inputs[name] = self._client.submit(
                    _worker.hold, self._chunks.content(name), key=key, pure=False
                )
        inputs = {name: self._inputs[name] for name in names}
        key = f"facemill-{tasks[0]['key'][:16]}-{_facemill.checksum(text.encode())[:16]}"
        future = self._client.submit(_worker.work, text, inputs, key=key, pure=False)
        self._at_work[key] = (future, tasks)
        future.add_done_callback(self._ended.put)

    def _take(self) -> None:
        """Waits for ends of chunks, and files what they bring."""
        try:
            ended = [self._ended.get(timeout=_LOOK)]
        except queue.Empty:
            self._look_for_scheduler()
            return
        while not self._ended.empty():
            ended.append(self._ended.get())
        ended = [future for future in ended if future.key in self._at_work]
        finished = [future for future in ended if future.status == "finished"]
        packs = self._client.gather(finished, errors="raise") if finished else []
        for future, pack in zip(finished, packs):
            self._file(self._at_work.pop(str(future.key))[1], pack)
        for future in ended:
            if future.status == "error":
                _, tasks = self._at_work.pop(str(future.key))
                why = str(future.exception())
                for task in tasks:
                    self._fail(task, _worker._failure(task["key"], _bare(task), 1) | {"kind": "machine", "cause": why})
            elif future.status in ("lost", "cancelled"):
                # The scheduler is gone, or came back without its tasks.
                raise Error(_GONE)

    def _look_for_scheduler(self) -> None:
        """Raises an error if the scheduler is gone; the client tries to reach it for a while."""
        if self._client.status in ("closing", "closed"):
            raise Error(_GONE)

    def _file(self, tasks: list[dict[str, Any]], pack: Any) -> None:
        """Files the results of a chunk."""
        files: dict[str, list[tuple[str, bytes]]] = {}
        if not isinstance(pack, bytes):
            raise Error("a worker answered with something else than bytes")
        with tarfile.open(fileobj=io.BytesIO(pack), mode="r:") as archive:
            for member in archive:
                key, _, name = member.name.partition("/")
                content = archive.extractfile(member) if member.isreg() else None
                if content is not None:
                    files.setdefault(key, []).append((name, content.read()))
        shared = self._chunks._options["shared_out"] is not None
        for task in tasks:
            key = task["key"]
            brought = files.get(key, [])
            if [name for name, _ in brought] == ["failed.json"]:
                self._fail(task, json.loads(brought[0][1]))
                continue
            code = _facemill.stored(self._folder, [key])[0] if shared else self._filed(key, brought)
            if code is None or code < 0:
                failure = _worker._failure(key, _bare(task), 1) | {"cause": "the worker reports a result that is not there"}
                self._fail(task, failure)
                continue
            self._summary.exit_codes[key] = code
            if self._on_end is not None:
                self._on_end(task, code)

    def _filed(self, key: str, brought: list[tuple[str, bytes]]) -> int | None:
        """Files a result; waits for another run that files the same one."""
        while True:
            code = _facemill.file_result(self._folder, key, brought)
            if code is not None:
                return code
            time.sleep(0.05)

    def _fail(self, task: dict[str, Any], failure: dict[str, Any]) -> None:
        key = task["key"]
        failure = {**failure, "key": key, "task": _bare(task)}
        _facemill.file_failure(self._folder, key, json.dumps(failure).encode())
        self._summary.failures[key] = failure["cause"]
        if failure["kind"] == "input":
            self._summary.wrong_input.add(key)
        if self._on_end is not None:
            self._on_end(task, None)
