"""``[policy]``: what makes an audit fail or unable to judge, where that differs, and what is waived until when."""

from datetime import date
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, field_validator, model_validator

from collaudit.core.config.config_table import ConfigTable, NonNegative, Positive
from collaudit.core.findings import CODES

#: Keys that only the decision over finished audits reads: no result of a single log depends on them.
OF_DECISION = (
    "max_residual_rms_nm",
    "max_friction_change",
    "min_observable_s",
    "max_fit_age_days",
    "levels",
    "findings",
    "overrides",
    "waivers",
)
Level = Literal["off", "warn", "error"]
#: Rules of the policy that have a level; findings have one by their code.
RuleName = Literal["contacts", "near_misses", "residual", "friction_change", "observable_time", "fit_age"]


def _known_codes(levels: dict[str, Level] | None) -> dict[str, Level] | None:
    for code in levels or {}:
        if code not in CODES:
            raise ValueError(f"{code!r} is no finding's code: docs/findings.md lists them")
    return levels


class PolicyOverride(ConfigTable):
    """Limits and levels that differ for some robots or logs; keys that are absent stay as they are."""

    robots: list[str] = Field([], description="Patterns of robots' names in `[fleet]`; every one when absent.")
    logs: list[str] = Field([], description="Patterns of logs' paths, as in `[fleet.robots]`; every one when absent.")
    max_collisions: Annotated[int, Field(ge=0)] | None = Field(None, description="As in `[policy]`.")
    max_near_misses_per_hour: NonNegative | None = Field(None, description="As in `[policy]`.")
    max_residual_rms_nm: Positive | dict[str, Positive] | None = Field(None, description="As in `[policy]`.")
    max_friction_change: Positive | None = Field(None, description="As in `[policy]`.")
    min_observable_s: NonNegative | None = Field(None, description="As in `[policy]`.")
    max_fit_age_days: Positive | None = Field(None, description="As in `[policy]`.")
    levels: dict[RuleName, Level] = Field({}, description="As in `[policy]`; merged with those.")
    findings: dict[str, Level] = Field({}, description="As in `[policy]`; merged with those.")

    _codes = field_validator("findings")(_known_codes)


class Waiver(ConfigTable):
    """A breach of one rule that somebody answers for until a day."""

    rule: str = Field(description="The rule: one of those in `levels`, or a finding's code.")
    reason: str = Field(min_length=3, description="Why the breach is accepted.")
    owner: str = Field(min_length=1, description="Who answers for it.")
    expires: date = Field(description="Last day on which it counts; after it, it is a finding.")
    up_to: NonNegative | None = Field(
        None,
        description="Largest value that is waived, in the unit of the rule's limit: contacts, near misses an hour, "
        "N·m, share, days. A greater breach is not waived. `contacts` must have it.",
    )
    robots: list[str] = Field([], description="Patterns of robots' names in `[fleet]`; every one when absent.")
    logs: list[str] = Field([], description="Patterns of logs' paths, as in `[fleet.robots]`; every one when absent.")
    joints: list[str] = Field([], description="Joints; every one when absent.")

    @field_validator("rule")
    @classmethod
    def _known(cls, value: str) -> str:
        if value not in get_args(RuleName) and value not in CODES:
            raise ValueError(f"{value!r} is no rule ({', '.join(get_args(RuleName))}) and no finding's code")
        return value

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        if self.rule == "contacts" and self.up_to is None:
            raise ValueError("a waiver of contacts needs up_to: how many contacts of a log it covers")
        return self


class PolicyConfig(ConfigTable):
    """What makes an audit fail, and what makes it unable to judge."""

    max_collisions: Annotated[int, Field(ge=0)] = Field(
        0, description="The audit fails if there are more contacts than this; alarms of several joints are one contact."
    )
    max_near_misses_per_hour: NonNegative | None = Field(
        None, description="The audit fails if there are more near misses an hour than this."
    )
    max_disturbed_at_rest: Annotated[int, Field(ge=0)] = Field(
        0,
        description="Disturbances of standing joints, below what alarms, that a log may have; with more it is not "
        "judged.",
    )
    observable_nm: Positive | dict[str, Positive] | None = Field(
        None,
        description="External torque that must be noticeable, N·m; one number, or by joint; for a joint that has "
        "none its `gamma_nm` and breakaway friction together, at least 2 and at most 5 times `gamma_nm`.",
    )
    min_observable: Annotated[float, Field(ge=0, le=1)] = Field(
        0.5,
        description="Least share of a watched joint's time in motion in which a torque of `observable_nm` would have "
        "alarmed; with less the log is not judged.",
    )
    max_hidden_s: Positive = Field(
        1800.0,
        description="Longest stretch in which a watched joint may hide a torque of `observable_nm`, at rest too, s; "
        "with a longer one the log is not judged.",
    )
    min_coverage: Annotated[float, Field(ge=0, le=1)] = Field(
        0.8,
        description="Least share of a watched joint's time in motion, gaps included, that could be judged; "
        "with less the log is not judged.",
    )
    max_residual_rms_nm: Positive | dict[str, Positive] | None = Field(
        None, description="`audit` fails if a joint's judged residual has a larger RMS, N·m; one number, or by joint."
    )
    max_friction_change: Positive | None = Field(
        None,
        description="`audit --baseline` fails if a joint's friction differs from the baseline's by more than this "
        "share, beyond the uncertainty of both.",
    )
    min_observable_s: NonNegative | None = Field(
        None,
        description="Least time of each watched joint, at rest included, in which a torque of `observable_nm` would "
        "have alarmed, s; `audit` does not judge a log with less.",
    )
    max_fit_age_days: Positive | None = Field(
        None,
        description="`audit` fails if friction was fitted on logs recorded longer than this before the log, days. A "
        "log or a fit without a date is not judged.",
    )
    levels: dict[RuleName, Level] = Field(
        {},
        description='What a breach of a rule does in `audit`: "error" (default) breaks the policy, "warn" is listed '
        'and breaks nothing, "off" is not looked at.',
    )
    findings: dict[str, Level] = Field(
        {},
        description="What a finding of a code does in `audit` beside its own effect: the same levels; off when absent. "
        "No level takes away that a finding forbids judging.",
    )
    overrides: list[PolicyOverride] = Field(
        [], description="Where limits or levels differ in `audit`; later ones win over earlier ones."
    )
    waivers: list[Waiver] = Field(
        [],
        description="Breaches that `audit` accepts until a day. What was not judged stays not judged.",
    )

    _codes = field_validator("findings")(_known_codes)
