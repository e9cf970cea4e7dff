"""What is said of a night beside its logs: files left out, acceptances, limits over all logs of a robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from urllib.parse import quote

from collaudit.core.data.audit_result import Verdict
from collaudit.core.data.cycles_result import ProgramComparison
from collaudit.core.data.left_out import LeftOut
from collaudit.core.errors import NotJudgedError
from collaudit.core.history.night_groups import NightGroup
from collaudit.core.policy.acceptance_use import AcceptanceUse
from collaudit.reports.values.entries import IndexEntry, entry_of_error, worst_verdict


@dataclass(frozen=True, slots=True)
class NightFacts:
    """A night as a whole.

    Attributes:
        sentence: what is said of all logs; empty: made of their lines.
        breaches: limits that all logs of a robot break together, a sentence each.
        left_out: files of its folders that were not judged; those that count as such are lines of their own, too.
        accepted: what became of each entry of accepted.toml.
        robots: whose each log is, by its name, where that is known.
        groups: what fails, by cause and place.
        reports: links to reports, relative to the audit's folder, by name of log.
        link: what these links begin with: where the folder will be found.
        changes: what changed in the programs of logs since an earlier audit.
        overlays: links to pages that lay a log over the same log of the baseline, by its name.
    """

    sentence: str = ""
    breaches: tuple[str, ...] = ()
    left_out: tuple[LeftOut, ...] = ()
    accepted: tuple[AcceptanceUse, ...] = ()
    robots: Mapping[str, str] = field(default_factory=dict)
    groups: tuple[NightGroup, ...] = ()
    reports: Mapping[str, str] = field(default_factory=dict)
    link: str = ""
    overlays: Mapping[str, str] = field(default_factory=dict)
    changes: tuple[ProgramComparison, ...] = ()

    @property
    def named(self) -> list[LeftOut]:
        """Files that are named and do not count."""
        return [file for file in self.left_out if not file.not_judged and file.kind != "companion"]

    @property
    def stale(self) -> list[AcceptanceUse]:
        """Entries of accepted.toml that a person should look at."""
        return [use for use in self.accepted if use.state not in ("counted", "not asked")]

    def link_of(self, name: str) -> str:
        """Where the report of a log is; the index page for a log without one; empty where nobody knows."""
        report = self.reports.get(name, "index.html")
        return self.link + quote(report.encode("utf-8", "surrogateescape"), safe="/") if self.reports else ""

    def verdict(self, entries: Sequence[IndexEntry]) -> Verdict:
        """The verdict on the night: the worst of its lines, and a failure where a limit is broken over all of them."""
        return "fail" if self.breaches else worst_verdict(entries)


#: A night of which nothing is said beside its logs.
QUIET = NightFacts()


def left_out_entries(files: Sequence[LeftOut]) -> list[IndexEntry]:
    """The lines of files that count as logs that were not judged."""
    errors = [
        (file.name, NotJudgedError(f"not judged: {file.text}", where=file.name)) for file in files if file.not_judged
    ]
    return [entry_of_error(name, error) for name, error in errors]
