"""Process that works on tasks: ``python -m facemill.batch._child OPTIONS``.

Takes a request on each line of standard input, and answers with a line on standard output. Ends
when standard input is closed, also in the middle of a task: whoever gave it is gone.
"""

from __future__ import annotations

import json
import os
import queue
import signal
import sys
import threading
from pathlib import Path
from typing import Any

from facemill import _facemill


def _answer(request: dict[str, Any]) -> dict[str, Any]:
    """Returns the answer to a request."""
    try:
        if "expand" in request:
            batch = Path(request["expand"])
            return {"tasks": _facemill.expand(batch, request["max_tasks"], request["allow_outside"])}
        end = _facemill.run_task(json.dumps(request["given"]), Path(request["out"]), request["passing"])
        return {"end": end}
    except _facemill.Error as error:
        return {"end": "failed", "message": str(error), "exit_code": getattr(error, "exit_code", 2)}
    # A panic of the compiled half is no Exception.
    except BaseException as error:
        return {"end": "failed", "message": f"internal failure: {error}", "exit_code": 3}


def _read(requests: queue.SimpleQueue[dict[str, Any]]) -> None:
    for line in sys.stdin:
        requests.put(json.loads(line))
    os._exit(130)


def main() -> None:
    """Answers requests until standard input is closed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    options = json.loads(sys.argv[1])
    if options.get("max_memory") is not None:
        _facemill.bound_memory(options["max_memory"])
    _facemill.confine([Path(folder) for folder in options["allow"]])
    requests: queue.SimpleQueue[dict[str, Any]] = queue.SimpleQueue()
    threading.Thread(target=_read, args=(requests,), daemon=True).start()
    while True:
        print(json.dumps(_answer(requests.get())), flush=True)


if __name__ == "__main__":
    main()
