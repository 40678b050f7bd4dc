"""Batches on a Dask cluster: the side of the client."""

from __future__ import annotations

import io
import json
import os
import queue
import tarfile
import time
from collections import Counter, deque
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

#: Time for which answers are waited for, s: those of dead workers are computed again.
_FETCH = 60.0

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
    lock_patience: float = 300.0,
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
    :param lock_patience: time after which a task is taken over from another run whose process gives
        no sign of life, s.
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
        "lock_patience": lock_patience,
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
        # An answer that is no bytes is an error, and is not unpickled.
        return Client(address, timeout=patience, set_as_default=False, deserializers=["dask", "msgpack"])
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
            yield self.of(self._tasks[k : k + self._size])

    def of(self, tasks: list[dict[str, Any]]) -> tuple[str, list[dict[str, Any]], list[str]]:
        """Returns a chunk of these tasks."""
        items = [self._item(task) for task in tasks]
        names = {name for item in items for name in item.get("tree", {}).values()}
        text = json.dumps({**self._options, "tasks": items}, sort_keys=True)
        return text, tasks, sorted(names)

    def _item(self, listed: dict[str, Any]) -> dict[str, Any]:
        """Returns what a worker has to know of a task."""
        task = _bare(listed)
        item: dict[str, Any] = {"key": listed["key"], "task": task}
        if self._options["shared_out"] is not None:
            item["inputs"] = listed["inputs"]
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
        #: Inputs at the scheduler, and the number of chunks there that need each.
        self._inputs: dict[str, Future] = {}
        self._users: Counter[str] = Counter()
        self._at_work: dict[str, _AtWork] = {}
        self._ended: queue.SimpleQueue[Future] = queue.SimpleQueue()
        #: Futures that ended and are at work again: their worker died before its answer was taken.
        self._again: list[Future] = []
        #: Tasks that are given once more, in chunks of their own.
        self._once_more: deque[list[dict[str, Any]]] = deque()
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
            self._again.clear()
            self._inputs.clear()

    def _submit_all(self) -> None:
        left = iter(self._chunks)
        more = True
        while more or self._at_work or self._once_more:
            ahead = self._ahead()
            while self._once_more:
                self._submit(*self._chunks.of(self._once_more.popleft()))
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
        self._at_work[key] = _AtWork(future, tasks, names)
        self._users.update(names)
        future.add_done_callback(self._ended.put)

    def _left(self, future: Future) -> list[dict[str, Any]]:
        """Takes note that a chunk is at its end, and returns its tasks."""
        at_work = self._at_work.pop(str(future.key))
        self._users.subtract(at_work.names)
        for name in at_work.names:
            if self._users[name] == 0:
                # Nothing at the scheduler needs it; workers keep it on their disks.
                del self._users[name], self._inputs[name]
        return at_work.tasks

    def _take(self) -> None:
        """Waits for ends of chunks, and files what they bring."""
        ended, self._again = self._again, []
        try:
            ended.append(self._ended.get(timeout=_LOOK))
        except queue.Empty:
            self._look_for_scheduler()
        while not self._ended.empty():
            ended.append(self._ended.get())
        finished = []
        for future in ended:
            if str(future.key) in self._at_work and self._status(future) == "finished":
                finished.append(future)
        for future, pack in self._gathered(finished):
            self._file(self._left(future), pack)

    def _status(self, future: Future) -> str:
        """Returns the status of a future; takes a failure, and keeps one that is at work again."""
        status = future.status
        if status == "error":
            self._broken(future)
        elif status == "cancelled":
            # The scheduler is gone, or came back without its tasks.
            raise Error(_GONE)
        elif status != "finished":
            self._again.append(future)
        return status

    def _gathered(self, futures: list[Future]) -> Iterator[tuple[Future, Any]]:
        """Returns the answers of chunks. One whose worker has died since is kept for later."""
        if not futures:
            return
        try:
            packs = self._gather(futures)
        except Exception:
            if self._client.status != "running":
                raise
        else:
            yield from zip(futures, packs)
            return
        # Something is wrong with one of them: each by itself.
        for future in futures:
            if self._status(future) != "finished":
                continue
            try:
                pack = self._gather([future])[0]
            except TypeError:
                # It would have to be unpickled.
                yield future, None
            except Exception:
                if self._client.status != "running":
                    raise
                if self._status(future) == "finished":
                    self._again.append(future)
            else:
                yield future, pack

    def _gather(self, futures: list[Future]) -> list[Any]:
        """Returns answers. Without a bound of time this waits until lost ones are computed again."""
        client = self._client
        return client.sync(client._gather, futures, errors="raise", callback_timeout=_FETCH)

    def _broken(self, future: Future) -> None:
        """Takes the end of a chunk that failed as a whole: its workers died, or it cannot run there."""
        tasks = self._left(future)
        if len(tasks) > 1:
            # One of them may be to blame, and not the others.
            self._once_more.extend([task] for task in tasks)
            return
        failure = {"kind": "machine", "cause": str(future.exception())}
        self._fail(tasks[0], _worker._failure(tasks[0]["key"], _bare(tasks[0]), 1) | failure)

    def _look_for_scheduler(self) -> None:
        """Raises an error if the scheduler is gone; the client tries to reach it for a while."""
        if self._client.status in ("closing", "closed"):
            raise Error(_GONE)

    def _file(self, tasks: list[dict[str, Any]], pack: Any) -> None:
        """Files the results of a chunk. A wrong answer fails its task, and no other one."""
        try:
            files = _unpacked(pack)
        except (tarfile.TarError, ValueError) as error:
            for task in tasks:
                self._wrong(task, f"the worker's answer is none: {error}")
            return
        missing = [task for task in tasks if task["key"] not in files]
        if missing and len(missing) < len(tasks):
            # The answer was large.
            self._once_more.append(missing)
            tasks = [task for task in tasks if task["key"] in files]
        for task in tasks:
            self._file_one(task, files.get(task["key"], []))

    def _file_one(self, task: dict[str, Any], brought: list[tuple[str, bytes]]) -> None:
        key = task["key"]
        names = [name for name, _ in brought]
        try:
            if names == ["failed.json"]:
                failure = json.loads(brought[0][1])
                self._record(task, {name: failure[name] for name in _worker._failure("", {}, 1)})
                code = None
            else:
                if self._chunks._options["shared_out"] is None:
                    code = _facemill.file_result(self._folder, key, brought)
                elif names == ["result.json"]:
                    code = _facemill.exit_code_of(key, brought[0][1])
                else:
                    raise Error("the worker reports a result and does not show it")
                self._summary.exit_codes[key] = code
        except (ValueError, KeyError, TypeError) as error:
            # A result that cannot be written is no fault of the answer.
            if isinstance(error, Error) and error.exit_code != 2:
                raise
            self._wrong(task, f"the worker's answer is wrong: {error}")
            return
        if self._on_end is not None:
            self._on_end(task, code)

    def _wrong(self, task: dict[str, Any], cause: str) -> None:
        """Takes a wrong answer."""
        self._fail(task, _worker._failure(task["key"], _bare(task), 1) | {"cause": cause})

    def _fail(self, task: dict[str, Any], failure: dict[str, Any]) -> None:
        """Takes the failure of a task."""
        self._record(task, failure)
        if self._on_end is not None:
            self._on_end(task, None)

    def _record(self, task: dict[str, Any], failure: dict[str, Any]) -> None:
        key = task["key"]
        failure = {**failure, "key": key, "task": _bare(task)}
        _facemill.file_failure(self._folder, key, json.dumps(failure).encode())
        self._summary.failures[key] = failure["cause"]
        if failure["kind"] == "input":
            self._summary.wrong_input.add(key)


@dataclass
class _AtWork:
    """Chunk at the scheduler."""

    future: Future
    tasks: list[dict[str, Any]]
    #: Checksums of its inputs.
    names: list[str]


def _unpacked(pack: Any) -> dict[str, list[tuple[str, bytes]]]:
    """Returns the files of a chunk's answer by key.

    :raises ValueError: if it is no archive.
    """
    if not isinstance(pack, bytes):
        raise ValueError("it is not bytes")
    files: dict[str, list[tuple[str, bytes]]] = {}
    with tarfile.open(fileobj=io.BytesIO(pack), mode="r:") as archive:
        for member in archive:
            key, _, name = member.name.partition("/")
            content = archive.extractfile(member) if member.isreg() else None
            if content is not None:
                files.setdefault(key, []).append((name, content.read()))
    return files
