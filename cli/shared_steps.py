"""What commands share beyond the front door: the one log meant, what is stated of it, judging, exit codes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import click

from collaudit.core.api import LogFiles, Progress, find_logs, log_name
from collaudit.core.config import LoadedConfig
from collaudit.core.contacts.contact_states import Precedents
from collaudit.core.data.audit_result import Audit, FrictionFile, Verdict
from collaudit.core.data.signals import CycleReference
from collaudit.core.errors import EXIT_FAIL, EXIT_NOT_JUDGED, EXIT_PASS, ConfigError
from collaudit.core.findings import Finding
from collaudit.core.scoring.detection_score import TruthFile, read_truth

if TYPE_CHECKING:
    from collaudit.core.prepare.calibration import KnownLoad

_NUMBERS = (1, 4)
truth_option = click.option(
    "--truth",
    multiple=True,
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Known contacts, left out: NAME.truth.json, or a .csv with onset_s, end_s; once for each input, in order.",
)


def one_log(arguments: Sequence[str], loaded: LoadedConfig) -> LogFiles:
    """The one log meant by the arguments, which may be several parts of it.

    Raises:
        LogError: nothing was found.
        ConfigError: the arguments are several logs.
    """
    logs = find_logs(arguments, loaded)
    if len(logs) != 1:
        raise ConfigError(
            "this command judges one log",
            found=f"{len(logs)}: {', '.join(log_name(files) for files in logs[:5])}",
            expected="one log (several files only when they are CSV parts of one recording)",
            hint="collaudit audit takes any number of logs",
        )
    return logs[0]


def audit_files(
    files: LogFiles,
    loaded: LoadedConfig,
    progress: Progress | None = None,
    truth: Path | None = None,
    known: Precedents | None = None,
    earlier: Sequence[CycleReference] = (),
) -> tuple[Audit, FrictionFile | None]:
    """Audit one log with the settings' friction, or with friction fitted on the log itself.

    Args:
        files: of the log.
        loaded: settings.
        progress: of reading.
        truth: file of known events to score the detection against.
        known: what is known of the robot's contacts beforehand.
        earlier: what passed nights say of the program's cycles.

    Returns:
        The audit, and the friction file it was judged with (None: fitted on the log).

    Raises:
        CollauditError: the log cannot be judged at all.
    """
    from collaudit.core import api
    from collaudit.core.small_files import file_sha256

    path = loaded.friction_path
    digest = file_sha256(path) if path else None
    friction = _friction(path, digest) if path and digest else None
    audit = api.audit(
        files,
        loaded,
        friction,
        truth=read_truth(truth) if truth else None,
        friction_sha256=digest,
        progress=progress,
        known=known,
        earlier=earlier,
    )
    return audit, friction


@lru_cache(maxsize=8)
def _friction(path: Path, _sha256: str) -> FrictionFile:
    """A friction file, read once while its content stays: the logs of a worker share it."""
    from collaudit.reports.files.run_files import read_friction

    return read_friction(path)


def known_contact(files: Sequence[Path], inputs: int) -> list[TruthFile | None]:
    """Truth files of the inputs; empty where none is given.

    Raises:
        ConfigError: not one for each input. LogError: one cannot be read.
    """
    _check_one_each("--truth", files, inputs)
    return [read_truth(file) for file in files]


def _check_one_each(option: str, given: Sequence[object], inputs: int) -> None:
    if given and len(given) != inputs:
        raise ConfigError(
            "this is given for some of the inputs only",
            where=option,
            found=f"{len(given)} for {inputs} inputs",
            expected="one for each, in their order",
        )


def known_loads(texts: Sequence[str], inputs: int) -> list[KnownLoad]:
    """Loads of the inputs; empty where none is given.

    Raises:
        ConfigError: not one for each input, or no mass and place.
    """
    from collaudit.core.prepare.calibration import KnownLoad

    _check_one_each("--load", texts, inputs)
    out = []
    for text in texts:
        try:
            numbers = [float(part) for part in text.split(",")]
        except ValueError:
            numbers = []
        if len(numbers) not in _NUMBERS or not 0.0 <= numbers[0] < 1e4 or not all(abs(x) < 1e3 for x in numbers[1:]):
            raise ConfigError("this is no load", where="--load", found=text, expected="KG or KG,X,Y,Z (m)")
        place = (numbers[1], numbers[2], numbers[3]) if len(numbers) > 1 else (0.0, 0.0, 0.0)
        out.append(KnownLoad(numbers[0], place))
    return out


def exit_code(verdicts: Sequence[Verdict]) -> int:
    """The contracted exit code: a broken policy wins over what could not be judged."""
    if "fail" in verdicts:
        return EXIT_FAIL
    return EXIT_NOT_JUDGED if "not_judged" in verdicts or not verdicts else EXIT_PASS


def forbidding(findings: Sequence[Finding]) -> str | None:
    """Where to look for what forbids judging; None when no finding does."""
    codes = sorted({finding.code for finding in findings if finding.forbids_pass})
    return f"see {', '.join(codes)} above" if codes else None
