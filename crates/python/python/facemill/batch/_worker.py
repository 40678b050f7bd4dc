"""Work of a Dask worker: inputs from the scheduler to its disk, tasks in children, results as bytes.

Only text and bytes go back: JSON, and files in a tar archive. The client unpickles nothing of them.
"""

from __future__ import annotations

import io
import json
import os
import shutil
import tarfile
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

from facemill import _facemill
from facemill._facemill import Error, checksum
from facemill.batch._process import Child, ChildEnded

#: Time between looks at a task that another run works on, s.
_BETWEEN_LOOKS = 0.2

#: Size of an answer after which a chunk ends, bytes.
_MOST_PACKED = 64 << 20

#: Children that wait for a task, of all runs together.
_MOST_IDLE = 2 * (os.cpu_count() or 1)

_idle: dict[str, list[Child]] = {}
_lock = threading.Lock()


def hold(content: bytes) -> bytes:
    """Returns an input: its task keeps it at the scheduler, and at each worker that needs it."""
    return content


def work(text: str, inputs: dict[str, bytes]) -> bytes:
    """Runs the tasks of a chunk, and returns their files and failures as a tar archive.

    :param text: chunk as JSON.
    :param inputs: contents of the input files by checksum.
    """
    from distributed import get_worker

    chunk = json.loads(text)
    local = Path(get_worker().local_directory) / "facemill"
    return run_chunk(chunk, inputs, local)


def run_chunk(chunk: dict[str, Any], inputs: dict[str, bytes], local: Path) -> bytes:
    """Runs the tasks of a chunk in a folder of this worker.

    Ends after the task with which the answer has become large: the others are missing from it, and
    the client gives them again.
    """
    shared = chunk["shared_out"]
    if shared is None:
        for name, content in inputs.items():
            _keep(local / "inputs", name, content)
    local.mkdir(parents=True, exist_ok=True)
    # Of its own: two runs of one batch may give this worker the same task.
    out = Path(shared or tempfile.mkdtemp(prefix="results-", dir=local))
    packed = io.BytesIO()
    try:
        with tarfile.open(fileobj=packed, mode="w") as archive:
            for item in chunk["tasks"]:
                failure = _run(item, chunk, local, out)
                key = item["key"]
                folder = out / "tasks" / key
                if failure is not None:
                    _add(archive, f"{key}/failed.json", json.dumps(failure).encode())
                elif shared is None:
                    for file in sorted(folder.iterdir()):
                        _add(archive, f"{key}/{file.name}", file.read_bytes())
                    shutil.rmtree(folder)
                else:
                    # The client may not see the new folder for a while.
                    _add(archive, f"{key}/result.json", (folder / "result.json").read_bytes())
                if packed.tell() > _MOST_PACKED:
                    break
    finally:
        if shared is None:
            shutil.rmtree(out, ignore_errors=True)
    return packed.getvalue()


def _add(archive: tarfile.TarFile, name: str, content: bytes) -> None:
    member = tarfile.TarInfo(name)
    member.size = len(content)
    archive.addfile(member, io.BytesIO(content))


def _run(item: dict[str, Any], chunk: dict[str, Any], local: Path, out: Path) -> dict[str, Any] | None:
    """Runs a task; returns its failure, or ``None`` if its result is in the folder."""
    key, task = item["key"], dict(item["task"])
    if chunk["shared_out"] is None:
        tree = _tree(local, item["tree"])
        task["job"] = str(tree / item["job"])
        if item["program"] is not None:
            task["program"] = str(tree / item["program"])
    allow = chunk["allow"] or [str(local)]
    given = {"task": task, "key": key, "inputs": item.get("inputs", []), "is_taken_over": False}
    request = {"given": given, "out": str(out), "passing": chunk["shared_out"] is None}
    lock, recorded = out / "locks" / key, out / "failed" / f"{key}.json"
    sign, since = -1, time.monotonic()
    tries = 0
    while True:
        tries += 1
        try:
            answer = _ask(request, allow, chunk["threads"], chunk["max_memory"])
        except ChildEnded as ended:
            failure = _died(ended, chunk["max_memory"])
            if failure["kind"] == "machine" and tries <= chunk["retries"]:
                continue
            return {**_failure(key, item["task"], tries), **failure}
        if answer["end"] == "filed":
            return None
        if answer["end"] == "locked":
            tries -= 1
            # A process that works changes the time of its lock again and again.
            try:
                last = lock.stat().st_mtime_ns
            except OSError:  # The other process has just ended.
                last = 0
            if last != sign:
                sign, since = last, time.monotonic()
            given["is_taken_over"] = time.monotonic() - since > chunk["lock_patience"]
            if not given["is_taken_over"]:
                time.sleep(_BETWEEN_LOOKS)
            continue
        code, message = answer.get("exit_code", 3), answer.get("message", answer["end"])
        if recorded.exists():
            failure = json.loads(recorded.read_bytes())
            # Another one is of an earlier run.
            if failure.get("exit_code") == code:
                return {**failure, "task": item["task"]}
        kind, cause = _facemill.cause_of_end(code, None, message, chunk["max_memory"])
        # The message of a failure is its cause, without how a process would have ended.
        cause = cause if kind == "machine" else message
        exit_code = None if kind == "machine" else code
        return {**_failure(key, item["task"], tries), "kind": kind, "cause": cause, "exit_code": exit_code}


def _failure(key: str, task: dict[str, Any], tries: int) -> dict[str, Any]:
    return {
        "format": "facemill-batch-failure/1",
        "key": key,
        "task": task,
        "kind": "internal",
        "cause": "",
        "exit_code": None,
        "signal": None,
        "tries": tries,
        "peak_mib": None,
    }


def _died(ended: ChildEnded, max_memory: int | None) -> dict[str, Any]:
    """Returns the cause for which a child ended."""
    signal = -ended.code if ended.code < 0 else None
    code = None if signal is not None else ended.code
    kind, cause = _facemill.cause_of_end(code, signal, ended.errors, max_memory)
    if kind == "interrupted":
        kind, cause = "machine", "ended by a termination request"
    return {"kind": kind, "cause": cause, "exit_code": code, "signal": signal}


def _ask(
    request: dict[str, Any], allow: list[str], threads: int | None, max_memory: int | None
) -> dict[str, Any]:
    """Gives a task to an idle child, or to a new one."""
    kind = json.dumps([allow, threads])
    child = None
    # A process that has run a task has less of its bound left.
    if max_memory is None:
        with _lock:
            waiting = _idle.get(kind, [])
            while waiting and child is None:
                child = waiting.pop()
                if not child.is_alive():
                    # Killed while it had nothing to do: not the fault of this task.
                    child.close()
                    child = None
    child = child or Child(allow, threads, max_memory)
    try:
        answer = child.ask(request)
    except BaseException:
        child.close()
        raise
    if max_memory is not None:
        child.close()
        return answer
    with _lock:
        _idle.setdefault(kind, []).append(child)
        # Of runs with other options, those that have waited the longest.
        others = [kept for name, kept in _idle.items() if name != kind]
        closed = []
        for kept in [*others, _idle[kind]]:
            while kept and sum(map(len, _idle.values())) > _MOST_IDLE:
                closed.append(kept.pop(0))
    for other in closed:
        other.close()
    return answer


def _keep(folder: Path, name: str, content: bytes) -> None:
    """Keeps an input under its checksum, whole."""
    place = folder / name
    if place.exists():
        return
    if checksum(content) != name:
        raise Error(f"an input of the checksum {name} has another content")
    folder.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=folder)
    with os.fdopen(handle, "wb") as file:
        file.write(content)
    os.replace(temporary, place)


def _tree(local: Path, names: dict[str, str]) -> Path:
    """Returns a folder with input files under their names."""
    place = local / "trees" / checksum(json.dumps(names, sort_keys=True).encode())
    if place.exists():
        return place
    place.parent.mkdir(parents=True, exist_ok=True)
    temporary = Path(tempfile.mkdtemp(dir=place.parent))
    for name, content in names.items():
        file = temporary / name
        if temporary not in Path(os.path.normpath(file)).parents:
            raise Error(f"{name}: is no name of an input")
        file.parent.mkdir(parents=True, exist_ok=True)
        try:
            os.link(local / "inputs" / content, file)
        except OSError:
            shutil.copyfile(local / "inputs" / content, file)
    try:
        os.rename(temporary, place)
    except OSError:
        # Another thread was faster.
        shutil.rmtree(temporary)
    return place
