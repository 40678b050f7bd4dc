"""Children: processes that work on tasks."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from typing import Any

#: Bytes that are kept of the end of a child's standard error.
_KEPT = 1 << 14


class ChildEnded(Exception):
    """End of a child in the middle of a request."""

    def __init__(self, code: int, errors: str) -> None:
        super().__init__(code, errors)
        self.code = code
        self.errors = errors


class Child:
    """Process of :mod:`facemill.batch._child`."""

    def __init__(self, allow: list[str], threads: int | None, max_memory: int | None) -> None:
        options = json.dumps({"allow": allow, "max_memory": max_memory})
        environment = dict(os.environ)
        if threads is not None:
            environment["RAYON_NUM_THREADS"] = str(threads)
        # A file, and no pipe: nobody has to read it while the child works.
        self._errors = tempfile.TemporaryFile()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "facemill.batch._child", options],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=self._errors,
            env=environment,
            # Ctrl-C is for the parent, which closes standard input.
            start_new_session=True,
        )

    def ask(self, request: dict[str, Any]) -> dict[str, Any]:
        """Returns the answer to a request.

        :raises ChildEnded: if the process ends instead.
        """
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None
        try:
            stdin.write(json.dumps(request).encode() + b"\n")
            stdin.flush()
            line = stdout.readline()
        except BrokenPipeError:
            line = b""
        if line.endswith(b"\n"):
            return json.loads(line)
        code = self._process.wait()
        size = self._errors.seek(0, os.SEEK_END)
        self._errors.seek(max(0, size - _KEPT))
        raise ChildEnded(code, self._errors.read().decode(errors="replace"))

    def is_alive(self) -> bool:
        """Returns whether the process has not ended."""
        return self._process.poll() is None

    def close(self) -> None:
        """Ends the process."""
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                try:
                    stream.close()
                except BrokenPipeError:
                    pass
        self._process.wait()
        self._errors.close()
