"""Result types of the decision over finished audits: what each rule says of each log, and what follows."""

from dataclasses import dataclass
from typing import Literal

from collaudit.core.data.audit_result import Verdict
from collaudit.core.findings import Finding

POLICY_SCHEMA = "collaudit/policy/1"
#: ``kept``; ``broken``; ``known``: broken, and the baseline shows the same within its noise; ``waived``: broken, and
#: somebody answers for it; ``not_judged``: what the rule needs is missing.
RuleState = Literal["kept", "broken", "known", "waived", "not_judged"]


@dataclass(frozen=True, slots=True)
class RuleOutcome:
    """What one rule of the policy says of one log.

    Attributes:
        rule: its name, or a finding's code.
        level: what a breach does.
        state: whether it is kept.
        text: what was found, with value and limit.
        joints: concerned; none for the whole arm.
        value, limit: in the unit of the limit; None where there is no number.
        note: what baseline or waiver say of it.
    """

    rule: str
    level: Literal["warn", "error"]
    state: RuleState
    text: str
    joints: tuple[str, ...] = ()
    value: float | None = None
    limit: float | None = None
    note: str | None = None


@dataclass(frozen=True, slots=True)
class LogDecision:
    """What was decided of one log.

    Attributes:
        log: its name.
        robot: whose it is; None without a fleet.
        place: its path or URL as it was given.
        folder: of its run, beside policy.json.
        verdict: of the audit as a whole; ``audit.json`` keeps the verdict on the log alone.
        reasons: why.
        rules: what each rule says.
    """

    log: str
    robot: str | None
    place: str
    folder: str
    verdict: Verdict
    reasons: tuple[str, ...]
    rules: tuple[RuleOutcome, ...]


@dataclass(frozen=True, slots=True)
class PolicyFile:
    """``policy.json``: the decision over an audit.

    Attributes:
        schema: ``collaudit/policy/1``.
        as_of: day on which waivers were looked at, ISO 8601.
        baseline: what was compared with, None for nothing.
        fail_on: what else than an error fails.
        logs: by log.
        findings: on the policy itself, such as waivers that have expired.
    """

    schema: str
    as_of: str
    baseline: str | None
    fail_on: tuple[str, ...]
    logs: tuple[LogDecision, ...]
    findings: tuple[Finding, ...]
