"""Batches on real clusters of Dask, compared with the command."""

from __future__ import annotations

import io
import json
import os
import shutil
import tarfile
import threading
import time
from pathlib import Path
from typing import Any

import pytest

import facemill
import facemill.batch
from conftest import KILL, Cluster, results, run_command, wait_for, write_batch
from facemill import _facemill
from facemill.batch import _worker
from facemill.batch._run import Summary, _Chunks, _Submission
from facemill.batch._worker import run_chunk


def expected(command: Path, batch: Path, out: Path) -> dict[str, bytes]:
    """Returns the results of the command."""
    done = run_command(command, "batch", "run", batch, "--out", out, "--quiet")
    assert done.returncode == 0, done.stderr
    return results(out)


def held_inputs(cluster: Cluster) -> list[int]:
    """Returns how many inputs each worker has on its disk."""
    return [len(list(worker.glob("**/facemill/inputs/*"))) for worker in sorted(cluster.folder.glob("worker-*/"))]


def test_tasks_are_those_of_the_command(tmp_path: Path, command: Path) -> None:
    batch = write_batch(tmp_path, 3)
    listed = json.loads(run_command(command, "batch", "expand", batch, "--json").stdout)["tasks"]
    assert facemill.batch.expand(batch) == listed and len(listed) == 3
    with pytest.raises(facemill.Error, match="more than 2 tasks"):
        facemill.batch.expand(batch, max_tasks=2)
    (tmp_path / "in").mkdir()
    outside = {"format": "facemill-batch/1", "jobs": {"list": ["../job.json"]}}
    (tmp_path / "in/batch.json").write_text(json.dumps(outside))
    with pytest.raises(facemill.Error, match="outside the folder of the batch"):
        facemill.batch.expand(tmp_path / "in/batch.json")


def test_a_killed_worker_changes_no_byte_and_nothing_runs_again(
    tmp_path: Path, command: Path, cluster: Cluster
) -> None:
    batch = write_batch(tmp_path / "batch", 12, fine=True)
    doomed, _ = cluster.start_worker(), cluster.start_worker()
    ended: list[int | None] = []

    def seen(task: dict[str, Any], code: int | None) -> None:
        ended.append(code)
        if len(ended) == 3:
            doomed.send_signal(KILL)

    out = tmp_path / "out"
    summary = facemill.batch.run(batch, out, cluster.address, on_end=seen)
    assert doomed.wait() == -KILL
    assert summary.exit_code == 0 and summary.already == 0 and len(ended) == 12
    assert results(out) == expected(command, batch, tmp_path / "by-command")
    assert all(not list((out / name).iterdir()) for name in ("tmp", "failed", "locks"))
    # Job, mesh, tool and machine, once for each worker.
    assert held_inputs(cluster) == [4, 4]
    # The command takes over, and the package from the command.
    again = run_command(command, "batch", "run", batch, "--out", out)
    assert again.returncode == 0 and "0 processes" in again.stdout
    resumed = facemill.batch.run(batch, tmp_path / "by-command", cluster.address)
    assert resumed.already == 12 and resumed.exit_code == 0


def test_a_killed_scheduler_ends_the_run_and_the_next_one_goes_on(
    tmp_path: Path, command: Path, cluster: Cluster
) -> None:
    batch = write_batch(tmp_path / "batch", 8, fine=True)
    cluster.start_worker()
    out = tmp_path / "out"
    ended: list[int | None] = []

    def seen(task: dict[str, Any], code: int | None) -> None:
        ended.append(code)
        if len(ended) == 2:
            cluster.scheduler.send_signal(KILL)

    with pytest.raises(facemill.Error, match="scheduler is gone"):
        facemill.batch.run(batch, out, cluster.address, patience=3, on_end=seen)
    kept = results(out)
    assert 2 <= len(ended) < 8
    made = {file: (out / file).stat().st_mtime_ns for file in kept}
    cluster.start_scheduler()
    cluster.start_worker()
    summary = facemill.batch.run(batch, out, cluster.address, chunk=2)
    assert summary.exit_code == 0 and summary.already == len(ended)
    assert results(out) == expected(command, batch, tmp_path / "by-command")
    assert all((out / file).stat().st_mtime_ns == time_made for file, time_made in made.items())
    with pytest.raises(facemill.Error, match="no scheduler at"):
        facemill.batch.run(batch, tmp_path / "none", "tcp://127.0.0.1:9", patience=2)


def test_a_shared_folder_and_jobs_that_fail(tmp_path: Path, command: Path, cluster: Cluster) -> None:
    batch = write_batch(tmp_path / "batch", 4)
    text = json.loads(batch.read_text())
    axis = text["jobs"]["sweep"]["axes"][0]
    axis["values"]["each"]["values"][1] = -1
    batch.write_text(json.dumps(text))
    cluster.start_worker()
    for name, shared in [("shared", True), ("sent", False)]:
        summary = facemill.batch.run(batch, tmp_path / name, cluster.address, shared=shared)
        assert summary.exit_code == 1 and len(summary.exit_codes) == 3 and len(summary.failures) == 1
        cause = next(iter(summary.failures.values()))
        assert "max_step_mm" in cause
        # Wrong input is not run again before it changes.
        again = facemill.batch.run(batch, tmp_path / name, cluster.address)
        assert again.already == again.tasks or again.failures == summary.failures
    done = run_command(command, "batch", "run", batch, "--out", tmp_path / "by-command", "--quiet")
    assert done.returncode == 1
    assert results(tmp_path / "shared") == results(tmp_path / "sent") == results(tmp_path / "by-command")
    failed = [list((tmp_path / name / "failed").iterdir()) for name in ("sent", "by-command")]
    assert [file.name for file in failed[0]] == [file.name for file in failed[1]]
    # Other input files in other folders: the job of a folder below names the files of the one above.
    below = tmp_path / "batch/below"
    below.mkdir()
    job = json.loads((tmp_path / "batch/job.json").read_text())
    job["tool"], job["machine"] = "../tool.json", "../machine.json"
    shutil.copy(tmp_path / "batch/part.obj", below / "part.obj")
    (below / "job.json").write_text(json.dumps(job))
    listed = {"format": "facemill-batch/1", "jobs": {"list": ["below", "job.json"]}}
    (tmp_path / "batch/list.json").write_text(json.dumps(listed))
    summary = facemill.batch.run(tmp_path / "batch/list.json", tmp_path / "list", cluster.address)
    assert summary.exit_code == 0, summary.failures
    assert results(tmp_path / "list") == expected(command, tmp_path / "batch/list.json", tmp_path / "list-by-command")


CAUSE_OF_KILL = "ended by signal 9 (kill, by a user or by the system for want of memory)"

GIVEN = {"threads": 1, "retries": 0, "max_memory": None, "lock_patience": 300.0, "shared_out": None, "allow": None}


def chunk_of(batch: Path, **options: Any) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Returns a chunk of all tasks of a batch, and its inputs, as the client sends them."""
    chunks = _Chunks(facemill.batch.expand(batch), 1000, {**GIVEN, **options})
    text, _, names = next(iter(chunks))
    return json.loads(text), {name: chunks.content(name) for name in names}


def test_a_child_that_dies_is_reported_with_its_cause(tmp_path: Path) -> None:
    batch = write_batch(tmp_path / "batch", 1, fine=True)
    chunk, inputs = chunk_of(batch)
    failures = []

    def work() -> None:
        pack = run_chunk(chunk, inputs, tmp_path / "local")
        with tarfile.open(fileobj=io.BytesIO(pack)) as archive:
            member = archive.extractfile(f"{chunk['tasks'][0]['key']}/failed.json")
            assert member is not None
            failures.append(json.loads(member.read()))

    thread = threading.Thread(target=work)
    thread.start()
    local = (tmp_path / "local").as_posix().encode()

    def child() -> int | None:
        for process in Path("/proc").glob("[0-9]*/cmdline"):
            try:
                if local in process.read_bytes() and b"_child" in process.read_bytes():
                    return int(process.parent.name)
            except OSError:
                continue
        return None

    os.kill(wait_for(child), KILL)
    thread.join(timeout=30)
    assert [(f["kind"], f["signal"], f["cause"]) for f in failures] == [("machine", KILL, CAUSE_OF_KILL)]
    # Out of memory is a cause of its own.
    chunk["max_memory"] = 64
    work()
    assert (failures[1]["kind"], failures[1]["cause"]) == ("machine", "out of memory within --max-memory 64 MiB")


def test_results_of_others_are_checked(tmp_path: Path, command: Path) -> None:
    batch = write_batch(tmp_path / "batch", 2)
    done = run_command(command, "batch", "run", batch, "--out", tmp_path / "out", "--quiet")
    assert done.returncode == 0
    keys = sorted(folder.name for folder in (tmp_path / "out/tasks").iterdir())
    files = [(f.name, f.read_bytes()) for f in (tmp_path / "out/tasks" / keys[0]).iterdir()]
    other = tmp_path / "other"
    with pytest.raises(facemill.Error, match=f"has the key {keys[0]}"):
        _facemill.file_result(other, keys[1], files)
    with pytest.raises(facemill.Error, match="and lists"):
        _facemill.file_result(other, keys[0], [*files, ("more.txt", b"")])
    without = [(name, content) for name, content in files if name != "program.nc"]
    with pytest.raises(facemill.Error, match="and lists"):
        _facemill.file_result(other, keys[0], without)
    renamed = [("../program.nc" if name == "program.nc" else name, content) for name, content in files]
    listing = json.loads(dict(files)["result.json"])
    listing["files"] = ["../program.nc" if name == "program.nc" else name for name in listing["files"]]
    renamed = [(n, json.dumps(listing).encode() if n == "result.json" else c) for n, c in renamed]
    with pytest.raises(facemill.Error, match="has a file named"):
        _facemill.file_result(other, keys[0], renamed)
    with pytest.raises(facemill.Error, match="is no key"):
        _facemill.file_result(other, "../" + keys[0], files)
    assert not (other / "tasks").exists() and not (tmp_path / "program.nc").exists()
    assert _facemill.file_result(other, keys[0], files) == 0
    assert {name: content for name, content in files} == {
        f.name: f.read_bytes() for f in (other / "tasks" / keys[0]).iterdir()
    }


def test_an_input_that_changes_is_not_filed(tmp_path: Path) -> None:
    batch = write_batch(tmp_path / "batch", 1)
    chunk, inputs = chunk_of(batch)
    # A worker whose facemill makes other keys.
    chunk["tasks"][0]["key"] = "0" * 64
    pack = run_chunk(chunk, inputs, tmp_path / "local")
    with tarfile.open(fileobj=io.BytesIO(pack)) as archive:
        assert archive.getnames() == ["0" * 64 + "/failed.json"]
        member = archive.extractfile("0" * 64 + "/failed.json")
        assert member is not None and json.loads(member.read())["kind"] == "input_changed"
    # A file that changes before it is sent.
    chunks = _Chunks(facemill.batch.expand(batch), 1, {"shared_out": None})
    _, _, names = next(iter(chunks))
    tool = tmp_path / "batch/tool.json"
    checksum = _facemill.checksum(tool.read_bytes())
    assert checksum in names and chunks.content(checksum) == tool.read_bytes()
    tool.write_bytes(tool.read_bytes() + b"\n")
    with pytest.raises(facemill.Error, match="tool.json: changed while the batch ran"):
        chunks.content(checksum)


def test_answers_that_are_lost_with_their_worker_are_made_again(
    tmp_path: Path, command: Path, cluster: Cluster
) -> None:
    batch = write_batch(tmp_path / "batch", 6)
    doomed = cluster.start_worker()
    ended: list[int | None] = []

    def seen(task: dict[str, Any], code: int | None) -> None:
        ended.append(code)
        if len(ended) == 1:
            # Its other tasks end while the client is busy here, which takes no answers.
            time.sleep(4)
            doomed.send_signal(KILL)
            doomed.wait()
            time.sleep(1)
            cluster.start_worker()

    out = tmp_path / "out"
    summary = facemill.batch.run(batch, out, cluster.address, on_end=seen)
    assert summary.exit_code == 0 and len(ended) == 6
    assert results(out) == expected(command, batch, tmp_path / "by-command")


def _answer(_text: str, _inputs: dict[str, bytes]) -> Any:
    return {"an": Path("object")}


def test_an_answer_that_would_be_unpickled_fails_its_tasks(
    tmp_path: Path, cluster: Cluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Workers import no tests: the function goes there as it is.
    _answer.__module__ = "__main__"
    monkeypatch.setattr(_worker, "work", _answer)
    cluster.start_worker()
    summary = facemill.batch.run(write_batch(tmp_path / "batch", 2), tmp_path / "out", cluster.address)
    assert summary.exit_code == 3
    assert set(summary.failures.values()) == {"the worker's answer is none: it is not bytes"}


class _NoClient:
    """Client that takes note of what is submitted."""

    status = "running"

    def __init__(self) -> None:
        self.submitted: list[str] = []

    def submit(self, _work: Any, *_arguments: Any, key: str, pure: bool) -> Any:
        self.submitted.append(key)
        return _NoFuture(key)


class _NoFuture:
    status = "error"

    def __init__(self, key: str) -> None:
        self.key = key

    def add_done_callback(self, _call: Any) -> None:
        pass

    def exception(self) -> Exception:
        return RuntimeError("its worker died three times")


def submission(batch: Path, out: Path, size: int) -> tuple[_Submission, list[Any]]:
    """Returns the submission of a batch whose first chunk is at work, and its end."""
    tasks = facemill.batch.expand(batch)
    chunks = _Chunks(tasks, size, GIVEN)
    _facemill.prepare_store(out, batch.read_bytes())
    ended: list[Any] = []
    made = _Submission(_NoClient(), chunks, out, Summary(len(tasks), 0), lambda *end: ended.append(end))  # type: ignore[arg-type]
    made._submit(*next(iter(chunks)))
    return made, ended


def test_a_chunk_that_fails_is_given_again_one_task_after_the_other(tmp_path: Path) -> None:
    made, ended = submission(write_batch(tmp_path / "batch", 3), tmp_path / "out", 3)
    made._broken(next(iter(made._at_work.values())).future)
    assert [len(tasks) for tasks in made._once_more] == [1, 1, 1] and not ended
    # Alone it is to blame.
    made._submit(*made._chunks.of(made._once_more.popleft()))
    made._broken(next(iter(made._at_work.values())).future)
    assert [code for _, code in ended] == [None]
    assert list(made._summary.failures.values()) == ["its worker died three times"]


def test_inputs_are_at_the_scheduler_while_a_chunk_needs_them(tmp_path: Path) -> None:
    made, _ = submission(write_batch(tmp_path / "batch", 2), tmp_path / "out", 1)
    first = next(iter(made._at_work.values())).future
    made._submit(*made._chunks.of(facemill.batch.expand(tmp_path / "batch/batch.json")[1:]))
    assert len(made._inputs) == 4
    made._left(first)
    assert len(made._inputs) == 4
    made._left(next(iter(made._at_work.values())).future)
    assert not made._inputs and not made._users


def test_a_wrong_answer_fails_its_task_alone(tmp_path: Path, command: Path) -> None:
    batch = write_batch(tmp_path / "batch", 3)
    run_command(command, "batch", "run", batch, "--out", tmp_path / "right", "--quiet")
    made, ended = submission(batch, tmp_path / "out", 3)
    tasks = next(iter(made._at_work.values())).tasks
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        for task, lost in zip(tasks, [None, "program.nc", None]):
            for file in (tmp_path / "right/tasks" / task["key"]).iterdir():
                if file.name != lost:
                    _worker._add(archive, f"{task['key']}/{file.name}", file.read_bytes())
    made._file(tasks, packed.getvalue())
    assert [code for _, code in ended] == [0, None, 0]
    assert "and lists" in made._summary.failures[tasks[1]["key"]]
    # One that is no failure either, and one that is nothing.
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        _worker._add(archive, f"{tasks[0]['key']}/failed.json", b'{"kind": "none"}')
    for pack in (packed.getvalue(), b"nothing" * 100, None):
        made._file(tasks[:1], pack)
        assert ended[-1][1] is None and "the worker's answer is" in made._summary.failures[tasks[0]["key"]]


def test_a_large_answer_ends_its_chunk_and_the_others_are_given_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    batch = write_batch(tmp_path / "batch", 3)
    chunk, inputs = chunk_of(batch)
    monkeypatch.setattr(_worker, "_MOST_PACKED", 1)
    pack = run_chunk(chunk, inputs, tmp_path / "local")
    made, ended = submission(batch, tmp_path / "out", 3)
    made._file(next(iter(made._at_work.values())).tasks, pack)
    assert [code for _, code in ended] == [0]
    assert [[task["number"] for task in tasks] for tasks in made._once_more] == [[2, 3]]
    assert not list((tmp_path / "local").glob("results-*"))


def test_a_child_that_died_idle_fails_no_task(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    chunk, inputs = chunk_of(write_batch(tmp_path / "batch", 2))
    monkeypatch.setattr(_worker, "_idle", {})
    first, second = ({**chunk, "tasks": [task]} for task in chunk["tasks"])
    run_chunk(first, inputs, tmp_path / "local")
    ((idle,),) = _worker._idle.values()
    idle._process.kill()
    idle._process.wait()
    with tarfile.open(fileobj=io.BytesIO(run_chunk(second, inputs, tmp_path / "local"))) as archive:
        assert not [name for name in archive.getnames() if name.endswith("failed.json")]
    # Of runs with other options no more wait than the bound.
    monkeypatch.setattr(_worker, "_MOST_IDLE", 1)
    run_chunk({**first, "threads": 2}, inputs, tmp_path / "local")
    assert [len(waiting) for waiting in _worker._idle.values()] == [0, 1]


def test_a_frozen_process_of_another_run_is_not_waited_for(tmp_path: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    batch = write_batch(tmp_path / "batch", 1)
    out = tmp_path / "out"
    _facemill.prepare_store(out, batch.read_bytes())
    chunk, _ = chunk_of(batch, shared_out=str(out), allow=[str(batch.parent)], lock_patience=0.5)
    key = chunk["tasks"][0]["key"]
    with open(out / "locks" / key, "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        pack = run_chunk(chunk, {}, tmp_path / "local")
    # The answer has the result itself: the folder may be seen later.
    with tarfile.open(fileobj=io.BytesIO(pack)) as archive:
        assert archive.getnames() == [f"{key}/result.json"]
    assert _facemill.stored(out, [key]) == [0]
