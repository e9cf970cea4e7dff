"""JSON Schemas of what commands print with ``--json`` and keep in no file of their own; ``make docs`` writes them.

Commands do without this module: what they print is compared with these schemas in tests.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from collaudit.cli.commands.logs import SCORE_SCHEMA
from collaudit.cli.main import ERROR_SCHEMA
from collaudit.core.data.audit_result import AuditResult, Cause, RecommendedRule, Verdict
from collaudit.core.data.detection_result import Score
from collaudit.core.data.recommendation_result import (
    ArmRate,
    PersistenceReason,
    RangeOfEvidence,
    SetRule,
    StretchToConfirm,
)
from collaudit.core.findings import Finding
from collaudit.core.history.night_row import JointNights
from collaudit.core.history.retention import KeptRun
from collaudit.core.logs.log_summary import ColumnInfo, TopicInfo
from collaudit.core.recommend.arm_recommendation import LogUse
from collaudit.core.recommend.joint_thresholds import AlarmPlane
from collaudit.fixtures.installation_checks import SELFTEST_SCHEMA, Selftest
from collaudit.reports.files.run_files import AUDITS_SCHEMA
from collaudit.reports.files.written_files import json_text
from collaudit.reports.terminal.command_texts import LevelRow, PushRow, TruthRow
from user_guide.result_schemas import schema_of

_DIALECT = "https://json-schema.org/draft/2020-12/schema"


@dataclass(frozen=True, slots=True)
class Inspected:
    """One log of ``inspect --json``; ``error`` says why it cannot be read as an audit would, null where it can."""

    name: str
    format: str
    size_bytes: int
    start_ns: int | None
    duration_s: float | None
    topics: list[TopicInfo]
    csv_columns: list[str]
    findings: list[Finding]
    columns: list[ColumnInfo]
    error: str | None


@dataclass(frozen=True, slots=True)
class Inspection:
    """What ``inspect --json`` prints."""

    schema: Literal["collaudit/inspect/1"]
    logs: list[Inspected]


@dataclass(frozen=True, slots=True)
class Drafted:
    """What ``init --json`` prints: the configuration, what trying it showed, and what is missing to judge the log."""

    schema: Literal["collaudit/init/1"]
    file: str | None
    toml: str
    guesses: int
    judged: bool
    verdict: Verdict | Literal["could_be_judged"] | None
    missing: list[str]
    findings: list[Finding]


@dataclass(frozen=True, slots=True)
class Recommended:
    """What ``recommend --json`` prints: thresholds with their evidence, assumptions and what is to be confirmed."""

    schema: Literal["collaudit/recommend/1"]
    logs: list[LogUse]
    persistence_s: float
    persistence_by: PersistenceReason
    arm: ArmRate
    joints: dict[str, RecommendedRule]
    set: dict[str, SetRule]
    ranges: dict[str, RangeOfEvidence]
    to_confirm: list[StretchToConfirm]
    counted: list[StretchToConfirm]
    if_clean_nm: dict[str, float]
    units: dict[str, str]
    assumptions: list[str]
    planes: dict[str, AlarmPlane]


@dataclass(frozen=True, slots=True)
class Written:
    """What ``report --json`` prints: files by format, verdicts by run."""

    schema: Literal["collaudit/written/1"]
    files: dict[str, list[str]]
    verdicts: dict[str, Verdict]


@dataclass(frozen=True, slots=True)
class BodyRegionRow:
    """One contact beside one limit, as text.

    Attributes:
        onset, joints, force: of the contact.
        region, limit: from the user's file.
        beside: how the force's interval lies to the limit.
    """

    onset: str
    joints: str
    force: str
    region: str
    limit: str
    beside: str


@dataclass(frozen=True, slots=True)
class ForcesOfLog:
    """One log of ``report --limits --json``."""

    log: str
    verdict: Verdict
    contacts: list[BodyRegionRow]


@dataclass(frozen=True, slots=True)
class Forces:
    """What ``report --limits --json`` prints: forces beside the limits of the user's file, and what not to conclude."""

    schema: Literal["collaudit/body-regions/1"]
    source: str
    note: str
    logs: list[ForcesOfLog]


@dataclass(frozen=True, slots=True)
class Simulated:
    """What ``simulate --json`` prints: the files that were written."""

    schema: Literal["collaudit/simulated/1"]
    log: list[str]
    config: str
    robot: str | None
    truth: str


@dataclass(frozen=True, slots=True)
class Demonstrated:
    """What ``demo --json`` prints: friction, pushes and residual beside their truth."""

    schema: Literal["collaudit/demo/1"]
    report: str
    right: bool
    friction: list[TruthRow]
    pushes: list[PushRow]
    residual: list[LevelRow]


@dataclass(frozen=True, slots=True)
class Audits:
    """``report --format json`` of several runs."""

    schema: Literal["collaudit/audits/1"]
    audits: list[AuditResult]


@dataclass(frozen=True, slots=True)
class Scores:
    """``score.json`` of a run: scores against known events."""

    schema: Literal["collaudit/score/1"]
    scores: list[Score]


@dataclass(frozen=True, slots=True)
class Explained:
    """What ``explain --json`` prints: the causes tried on a log, the best first."""

    schema: Literal["collaudit/explain/1"]
    log: str
    verdict: Verdict
    causes: tuple[Cause, ...]


@dataclass(frozen=True, slots=True)
class Checked:
    """What ``check --json`` prints: configuration to what keeps it from being used, null where it can be."""

    schema: Literal["collaudit/check/1"]
    problems: dict[str, str | None]


@dataclass(frozen=True, slots=True)
class Accepted:
    """What ``accept --json`` prints: the file, and the entries that were added to it or taken out, in words."""

    schema: Literal["collaudit/accept/1"]
    file: str
    added: list[str]
    removed: list[str]


@dataclass(frozen=True, slots=True)
class Answer:
    """What ``query --json`` prints: names of columns, and rows of what SQL gave."""

    schema: Literal["collaudit/query/1"]
    columns: list[str]
    rows: list[list[Any]]


@dataclass(frozen=True, slots=True)
class Trends:
    """What ``trend --json`` prints: every night of every joint."""

    schema: Literal["collaudit/trend/2"]
    joints: list[JointNights]


@dataclass(frozen=True, slots=True)
class Pruned:
    """What ``store prune --json`` prints: how many runs stay, whether it was done, and the runs that go."""

    schema: Literal["collaudit/prune/1"]
    place: str
    kept: int
    done: bool
    runs: list[KeptRun]


@dataclass(frozen=True, slots=True)
class Failed:
    """What a command that was given ``--json`` prints when it fails; the text is on stderr."""

    schema: Literal["collaudit/error/1"]
    exit_code: int
    kind: str
    message: str
    where: str | None = None
    found: str | None = None
    expected: str | None = None
    hint: str | None = None


_PRINTED: dict[str, tuple[Any, str]] = {
    "collaudit/inspect/1": (Inspection, "inspect --json"),
    "collaudit/init/1": (Drafted, "init --json"),
    "collaudit/recommend/1": (Recommended, "recommend --json"),
    "collaudit/written/1": (Written, "report --json"),
    "collaudit/body-regions/1": (Forces, "report --limits --json"),
    "collaudit/simulated/1": (Simulated, "simulate --json"),
    "collaudit/demo/1": (Demonstrated, "demo --json"),
    SELFTEST_SCHEMA: (Selftest, "selftest --json"),
    AUDITS_SCHEMA: (Audits, "report --format json of several runs"),
    SCORE_SCHEMA: (Scores, "score.json of a run"),
    "collaudit/check/1": (Checked, "check --json"),
    "collaudit/explain/1": (Explained, "explain --json"),
    "collaudit/accept/1": (Accepted, "accept --json"),
    "collaudit/query/1": (Answer, "query --json"),
    "collaudit/trend/2": (Trends, "trend --json"),
    "collaudit/prune/1": (Pruned, "store prune --json"),
    ERROR_SCHEMA: (Failed, "any command with --json that fails"),
}


def output_schemas() -> dict[str, dict[str, Any]]:
    """``schema`` key to JSON Schema, of everything that commands print beside the result files."""
    made = {}
    for version, (kind, printed_by) in _PRINTED.items():
        body = schema_of(kind)
        body["properties"]["schema"] = {"const": version}
        made[version] = {"$schema": _DIALECT, **body, "title": f"collaudit: {printed_by}"}
    return made


def output_schema_texts() -> dict[str, str]:
    """File name to JSON Schema."""
    return {f"{version.split('/')[1]}-1.schema.json": json_text(made) for version, made in output_schemas().items()}
