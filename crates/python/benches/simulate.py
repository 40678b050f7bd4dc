"""Model of a large cluster: its time on paper, and simulated event by event.

``python benches/simulate.py`` prints the table of docs/python.md. Client and scheduler serve one chunk
after the other, each when it is submitted and when it has ended; workers run them side by side.
"""

from __future__ import annotations

import heapq
import random
from collections import deque
from dataclasses import dataclass


@dataclass(frozen=True)
class Costs:
    """Costs of a run, s, as ``benches/cluster.py`` measures them: processor time, and of the client its disk."""

    client_chunk: float
    client_task: float
    scheduler_chunk: float
    scheduler_task: float


@dataclass(frozen=True)
class Load:
    """Tasks in chunks on workers of one thread."""

    workers: int
    tasks: int
    chunk: int
    #: Mean time of a task, s.
    task_s: float


def on_paper(load: Load, costs: Costs) -> tuple[float, str]:
    """Returns the time of a run, s: that of its slowest part, with the last chunk of a worker."""
    parts = {
        "workers": load.tasks * load.task_s / load.workers + load.chunk * load.task_s,
        "scheduler": load.tasks * (costs.scheduler_chunk / load.chunk + costs.scheduler_task),
        "client": load.tasks * (costs.client_chunk / load.chunk + costs.client_task),
    }
    slowest = max(parts, key=lambda name: parts[name])
    return parts[slowest], slowest


def simulated(load: Load, costs: Costs, seed: int = 1) -> float:
    """Returns the time of a run, s, with task times between half and one and a half of the mean."""
    numbers = random.Random(seed)
    chunks = -(-load.tasks // load.chunk)
    ahead = max(64, 8 * load.workers)
    client = (costs.client_chunk + load.chunk * costs.client_task) / 2
    scheduler = (costs.scheduler_chunk + load.chunk * costs.scheduler_task) / 2
    # The sum of the uniform times of a chunk: its mean, and the deviation of a sum.
    spread = load.task_s * (load.chunk / 12) ** 0.5

    def duration() -> float:
        if load.chunk == 1:
            return load.task_s * (0.5 + numbers.random())
        return max(load.chunk * load.task_s + spread * numbers.gauss(0, 1), 0.0)

    # Events: time, number, what ends there.
    events: list[tuple[float, int, str]] = []
    counter = 0
    idle = load.workers
    client_free = scheduler_free = 0.0
    waiting: deque[float] = deque()
    submitted = filed = 0
    now = 0.0

    def at(time: float, what: str) -> None:
        nonlocal counter
        counter += 1
        heapq.heappush(events, (time, counter, what))

    def submit() -> None:
        nonlocal submitted, client_free
        submitted += 1
        client_free = max(client_free, now) + client
        at(client_free, "submitted")

    for _ in range(min(ahead, chunks)):
        submit()
    while filed < chunks:
        now, _, what = heapq.heappop(events)
        if what == "submitted":
            scheduler_free = max(scheduler_free, now) + scheduler
            at(scheduler_free, "ready")
        elif what == "ready":
            waiting.append(now)
        elif what == "done":
            idle += 1
            scheduler_free = max(scheduler_free, now) + scheduler
            at(scheduler_free, "reported")
        elif what == "reported":
            client_free = max(client_free, now) + client
            at(client_free, "filed")
        elif what == "filed":
            filed += 1
            if submitted < chunks:
                submit()
        while idle and waiting:
            waiting.popleft()
            idle -= 1
            at(now + duration(), "done")
    return now


#: Measured on two cores: results through the scheduler, which the client writes through to its disk, and in a
#: shared folder.
SENT = Costs(client_chunk=3.7e-3, client_task=8.6e-3, scheduler_chunk=3.1e-3, scheduler_task=0.05e-3)
SHARED = Costs(client_chunk=2.4e-3, client_task=0.1e-3, scheduler_chunk=2.6e-3, scheduler_task=0.1e-3)


def main() -> None:
    """Prints the table."""
    print("| task | results | tasks in a chunk | on paper | simulated | slowest part | share of 1,000 workers in use |")
    print("|---|---|---|---|---|---|---|")
    for task_s in (10.0, 1.0):
        for name, costs in (("sent", SENT), ("shared folder", SHARED)):
            for chunk in (1, 10, 100):
                load = Load(workers=1000, tasks=1_000_000, chunk=chunk, task_s=task_s)
                paper, slowest = on_paper(load, costs)
                time = simulated(load, costs)
                used = load.tasks * load.task_s / load.workers / time
                print(
                    f"| {task_s:.0f} s | {name} | {chunk} | {paper / 60:.0f} min | {time / 60:.0f} min | {slowest} | "
                    f"{100 * used:.0f} % |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
