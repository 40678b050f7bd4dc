"""Jobs, plans, verification and feeds."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, Mapping, Union

from facemill import _facemill
from facemill._facemill import Error
from facemill._machine import Machine

#: Job: path of a job file or of a folder with ``job.json``, or the content of a job file.
Job = Union[str, "os.PathLike[str]", Mapping[str, Any]]

#: Content of a file: bytes, text, or the values of a JSON file.
Content = Union[bytes, bytearray, str, Mapping[str, Any]]


class _GivenJob:
    """Job as the compiled half takes it."""

    def __init__(
        self,
        job: Job,
        folder: str | os.PathLike[str] | None,
        files: Mapping[str, Content] | None,
        settings: Mapping[str, Any] | None,
    ) -> None:
        self.settings = [f"{key}={json.dumps(value)}" for key, value in (settings or {}).items()]
        self.folder = None if folder is None else Path(folder)
        self.files = {name: _bytes_of(content) for name, content in (files or {}).items()}
        self.path: Path | None = None
        self.text: bytes | None = None
        if not isinstance(job, Mapping):
            if folder is not None or files:
                raise Error("folder and files: only for a job that is given as a dict")
            self.path = Path(job)
        elif settings:
            raise Error("settings: only for a job that is given as a path; change the dict")
        else:
            self.text = json.dumps(job).encode()


def _bytes_of(content: Content) -> bytes:
    if isinstance(content, Mapping):
        return json.dumps(content).encode()
    return content.encode() if isinstance(content, str) else bytes(content)


#: Files of subprograms: texts by file name, or the folder that has them.
Subprograms = Union[Mapping[str, Union[str, bytes]], str, "os.PathLike[str]"]


def _subprogram_files(subprograms: Subprograms | None) -> tuple[dict[str, bytes], Path | None]:
    """Returns files of subprograms in memory, and the folder of others.

    :raises Error: if the folder is none.
    """
    if subprograms is None:
        return {}, None
    if isinstance(subprograms, Mapping):
        return {file: _bytes_of(content) for file, content in subprograms.items()}, None
    folder = Path(subprograms)
    if not folder.is_dir():
        raise Error(f"subprograms: {folder} is no folder; give a folder, or a dict of texts by file name")
    return {}, folder


class Report:
    """Plan of a setup: program, report and files.

    The values of the report (``report.json``) are attributes by their names: ``totals``,
    ``times``, ``worst``, ``findings``, ``assumptions`` and others; ``facemill schema report``
    describes them.
    """

    def __init__(self, values: dict[str, Any], summary: str, exit_code: int, files: dict[str, bytes]) -> None:
        self._values = values
        self.summary = summary
        self.exit_code = exit_code
        self.files = files

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):
            raise AttributeError(name)
        try:
            return self._values[name]
        except KeyError:
            raise AttributeError(f"the report has no {name}") from None

    def __dir__(self) -> list[str]:
        return sorted({*super().__dir__(), *self._values})

    def __repr__(self) -> str:
        return f"Report({', '.join(self.programs)}, exit code {self.exit_code})"

    @property
    def is_clean(self) -> bool:
        """Whether the program meets the job and has no fault."""
        return self.exit_code == 0

    @property
    def programs(self) -> dict[str, str]:
        """Texts of the programs by file name: one, or one for each channel of two heads."""
        return {stamp["file"]: self.files[stamp["file"]].decode() for stamp in self._values["programs"]}

    @property
    def program(self) -> str:
        """Text of the program.

        :raises Error: if there are several.
        """
        texts = list(self.programs.values())
        if len(texts) != 1:
            raise Error(f"there are {len(texts)} programs: take them from `programs`")
        return texts[0]

    def to_dict(self) -> dict[str, Any]:
        """Returns the report as ``report.json`` has it."""
        return json.loads(json.dumps(self._values))

    def write(self, folder: str | os.PathLike[str]) -> None:
        """Writes all files into a folder, and removes those of an earlier plan there."""
        _facemill.write_plan(Path(folder), self.files)


def plan(
    job: Job,
    setup: int = 0,
    verify: bool = True,
    certificates: bool = False,
    *,
    folder: str | os.PathLike[str] | None = None,
    files: Mapping[str, Content] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Report:
    """Plans a setup of a job: the bytes of all files are those of ``facemill plan``.

    :param job: path of a job file or of its folder, or the content of a job file as a dict.
    :param setup: index of the setup, from 0.
    :param verify: run the written program on the virtual machine, and cut the stock.
    :param certificates: prove the motion of every block between its ends.
    :param folder: of a dict, the folder of the files that it names.
    :param files: of a dict, files that it names by name, in memory.
    :param settings: of a path, values that replace those of the file by key, such as
        ``{"operations[0].tolerances.cusp_mm": 0.1}``.
    :raises Error: if the input is wrong, or the job infeasible. A plan with findings is a result.
    """
    given = _GivenJob(job, folder, files, settings)
    planned = _facemill.plan(given, setup, verify, certificates)
    return Report(json.loads(planned["report"]), planned["summary"], planned["exit_code"], planned["files"])


class Verification:
    """Run of a program on the virtual machine.

    The values of ``verification.json`` are in :meth:`to_dict`; ``facemill schema verification``
    describes them.
    """

    def __init__(self, values: dict[str, Any], faults: int) -> None:
        self._values = values
        self.faults = faults

    def __repr__(self) -> str:
        return f"Verification({len(self.findings)} findings, {self.faults} of them faults)"

    @property
    def is_clean(self) -> bool:
        """Whether there is no fault."""
        return self.faults == 0

    @property
    def findings(self) -> list[dict[str, Any]]:
        """Findings, each with kind, lines, bodies and depth (mm).

        Lines count on from the program through :attr:`called_files`.
        """
        return self._values["findings"]

    @property
    def called_files(self) -> list[dict[str, Any]]:
        """Files of subprograms, each with name, checksum and the line where it begins."""
        return self._values.get("called_files", [])

    @property
    def times(self) -> dict[str, Any]:
        """Times of the program, s."""
        return self._values["times"]

    def to_dict(self) -> dict[str, Any]:
        """Returns the results as ``verification.json`` has them."""
        return json.loads(json.dumps(self._values))


def verify(
    program: str | bytes,
    job: Job,
    setup: int = 0,
    dialect: str | None = None,
    certificates: bool = False,
    stock_cell_mm: float | None = None,
    *,
    subprograms: Subprograms | None = None,
    name: str = "program",
    folder: str | os.PathLike[str] | None = None,
    files: Mapping[str, Content] | None = None,
    settings: Mapping[str, Any] | None = None,
) -> Verification:
    """Runs an NC program, from any source, on the virtual machine of a job's setup.

    :param program: text of the program.
    :param job: as for :func:`plan`; its machine, mounting, tool, part, fixtures and stock count.
    :param dialect: control of the program; default: the job's.
    :param certificates: prove the motion of every block between its ends.
    :param stock_cell_mm: distance of the lines on which the stock is cut; default: it is not cut.
    :param subprograms: files of subprograms that the program calls: a dict of texts by file name,
        or the folder that has them. Those in the program's own text are always found.
    :param name: name of the program in messages.
    :raises Error: if the program cannot be read, or the job is wrong.
    """
    text = program.encode() if isinstance(program, str) else bytes(program)
    given = _GivenJob(job, folder, files, settings)
    texts, of_folder = _subprogram_files(subprograms)
    result = json.loads(
        _facemill.verify(
            text, Path(name), given, setup, dialect, certificates, stock_cell_mm, texts, of_folder
        )
    )
    return Verification(result["verification"], result["faults"])


class Retimed:
    """Program with new feeds: its text, and a summary of the changes (times in s).

    The text has the blocks of subprograms in place of their calls; ``called_files`` are those of
    files, each with name, checksum and the line where it begins if lines count on from the program.
    """

    def __init__(self, program: str, summary: dict[str, Any], called_files: list[dict[str, Any]]) -> None:
        self.program = program
        self.summary = summary
        self.called_files = called_files

    def __repr__(self) -> str:
        return f"Retimed({self.summary['changed']} of {self.summary['blocks']} blocks with another F)"


def feedrate(
    program: str | bytes,
    machine: Machine,
    tool_length: float,
    tip_feed: float | str | None = None,
    *,
    dialect: str = "fanuc",
    time_law: bool = False,
    blend_tolerance: float | None = None,
    work_offset: Mapping[str, float] | None = None,
    subprograms: Subprograms | None = None,
    name: str = "program",
) -> Retimed:
    """Gives every straight cutting block the F at which the tip moves at its speed.

    :param tool_length: distance from the gauge line to the tip, mm.
    :param tip_feed: speed of the tip, mm/min; ``"keep"``: the speed by the program's F; default:
        each block's own F is the speed of the tip.
    :param dialect: control of the program.
    :param time_law: also stay within acceleration and jerk of every axis.
    :param blend_tolerance: largest deviation at corners, mm, for ``time_law``.
    :param work_offset: machine position of the words' zero by axis, mm or degrees.
    :param subprograms: as for :func:`verify`; the new program has their blocks in place of the calls.
    :param name: name of the program in messages.
    :raises Error: if the program cannot be read or retimed; the message has file and line.
    """
    text = program.encode() if isinstance(program, str) else bytes(program)
    if isinstance(tip_feed, str) and tip_feed != "keep":
        raise Error(f'tip_feed: must be a speed in mm/min, or "keep", is {tip_feed}')
    keep = tip_feed == "keep"
    speed = None if keep or tip_feed is None else float(tip_feed)
    texts, of_folder = _subprogram_files(subprograms)
    new, summary, called_files = _facemill.feedrate(
        text,
        machine._machine,
        tool_length,
        speed,
        keep,
        dialect,
        time_law or blend_tolerance is not None,
        blend_tolerance,
        {axis.upper(): float(value) for axis, value in (work_offset or {}).items()},
        Path(name),
        texts,
        of_folder,
    )
    return Retimed(new.decode(), json.loads(summary), json.loads(called_files))


def example_job(part: str = "patch", size_mm: float = 60.0) -> dict[str, bytes]:
    """Returns the files of an example job by name, to begin a job of one's own with.

    :param part: ``"patch"``, a wavy square, or ``"propeller"``, DTMB 4119.
    :param size_mm: its side or diameter, mm.
    """
    return _facemill.example_job(part, size_mm)
