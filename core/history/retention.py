"""Which stored runs may go: by age, then by size; failed ones and those that were not judged stay longer."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

from collaudit.core.data.audit_result import Verdict


@dataclass(frozen=True, slots=True)
class KeptRun:
    """A judged log that is stored.

    Attributes:
        place: what it is known by where it is stored.
        robot: whose log it is, None where nobody says.
        program: of its log, without dates and times.
        night: the day it counts to.
        verdict: on the log.
        size: of what would go, bytes.
        needed: why it may not go, whatever its age; empty where nothing needs it.
    """

    place: str
    robot: str | None
    program: str
    night: date
    verdict: Verdict
    size: int
    needed: str = ""


def runs_to_prune(
    runs: Sequence[KeptRun], passed_days: float, other_days: float, most_bytes: int | None, today: date
) -> list[KeptRun]:
    """The runs that go, oldest first.

    What is needed stays, and of each robot and program the latest run that was judged: tonight is compared with it.
    Where what stays is still too large, the oldest runs that passed go before any other.

    Args:
        runs: all that are stored.
        passed_days: so long stay runs that passed.
        other_days: and runs that failed or were not judged; no shorter.
        most_bytes: of all that stays together; None for any.
        today: the day they are looked at.
    """
    latest: dict[tuple[str | None, str], KeptRun] = {}
    for run in runs:
        other = latest.get((run.robot, run.program))
        if run.verdict != "not_judged" and (other is None or run.night >= other.night):
            latest[run.robot, run.program] = run
    kept_days = {"pass": passed_days, "fail": other_days, "not_judged": other_days}
    references = set(latest.values())
    free = sorted(
        (run for run in runs if not run.needed and run not in references),
        key=lambda run: (run.verdict != "pass", run.night, run.place),
    )
    gone = {run for run in free if (today - run.night).days > kept_days[run.verdict]}
    size = sum(run.size for run in runs if run not in gone)
    for run in free:
        if most_bytes is not None and size > most_bytes and run not in gone:
            gone.add(run)
            size -= run.size
    return sorted(gone, key=lambda run: (run.night, run.place))
