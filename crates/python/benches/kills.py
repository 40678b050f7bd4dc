"""Faults of a cluster under load: ``python benches/kills.py [TASKS] [FAULTS] [SEED]``, 300, 20 and 1 without arguments.

Runs a batch on two workers of this machine, and at random times kills a worker, stops one for good
(as a machine that freezes), or kills the scheduler; starts others in their place, and the run again
where it ends. Compares all results with those of the command.
"""

from __future__ import annotations

import random
import signal
import sys
import tempfile
import threading
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

import facemill.batch
from conftest import KILL, ROOT, Cluster, results, run_command, write_batch


class Faults(threading.Thread):
    """Faults at random times, one after the other."""

    def __init__(self, cluster: Cluster, n: int, between: float, seed: int) -> None:
        super().__init__(daemon=True)
        self.cluster, self.n, self.between = cluster, n, between
        self.random = random.Random(seed)
        self.done: dict[str, int] = {}
        #: Set while a run is at work.
        self.running = threading.Event()
        self.over = threading.Event()

    def run(self) -> None:
        stopped = []
        kinds = ["worker killed", "scheduler killed", "worker stopped", "worker killed"]
        for k in range(self.n):
            time.sleep(self.random.uniform(0.2, self.between))
            self.running.wait()
            if self.over.is_set():
                return
            kind = kinds[k % len(kinds)]
            alive = [worker for worker in self.cluster.workers if worker.poll() is None and worker not in stopped]
            if kind == "scheduler killed":
                self.running.clear()
                self.cluster.scheduler.send_signal(KILL)
            else:
                doomed = self.random.choice(alive)
                doomed.send_signal(KILL if kind == "worker killed" else signal.SIGSTOP)
                stopped.append(doomed)
                self.cluster.start_worker()
            self.done[kind] = self.done.get(kind, 0) + 1


def main() -> None:
    tasks, faults, seed = [int(a) for a in sys.argv[1:]] + [300, 20, 1][len(sys.argv) - 1 :]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "cluster").mkdir()
        batch = write_batch(folder / "batch", tasks)
        began = time.monotonic()
        command = ROOT / "target/debug/facemill"
        done = run_command(command, "batch", "run", batch, "--out", folder / "expected", "--quiet")
        assert done.returncode == 0, done.stderr
        alone = time.monotonic() - began
        print(f"{tasks} tasks by the command: {alone:.0f} s", flush=True)
        # The scheduler gives up a worker that says nothing for so long.
        cluster = Cluster(folder / "cluster", {"DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "5s"})
        cluster.start_worker(), cluster.start_worker()
        disturbance = Faults(cluster, faults, 1.2 * alone / faults, seed)
        disturbance.start()
        began, runs, finished = time.monotonic(), 0, {}
        try:
            while True:
                runs += 1
                disturbance.running.set()
                try:
                    summary = facemill.batch.run(batch, folder / "out", cluster.address, patience=2)
                    break
                except facemill.Error as error:
                    assert "scheduler is gone" in str(error), error
                    for file in results(folder / "out"):
                        made = (folder / "out" / file).stat().st_mtime_ns
                        assert finished.setdefault(file, made) == made, f"{file} was made again"
                    for worker in cluster.workers:
                        worker.kill()
                    cluster.start_scheduler()
                    cluster.start_worker(), cluster.start_worker()
            took = time.monotonic() - began
            disturbance.over.set()
        finally:
            cluster.close()
        assert summary.exit_code == 0, summary.failures
        assert all((folder / "out" / file).stat().st_mtime_ns == made for file, made in finished.items())
        assert results(folder / "out") == results(folder / "expected"), "the results differ"
        said = ", ".join(f"{n} × {kind}" for kind, n in sorted(disturbance.done.items()))
        print(f"{sum(disturbance.done.values())} faults ({said}), {runs} runs in {took:.0f} s: all results equal")


if __name__ == "__main__":
    main()
