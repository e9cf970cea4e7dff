"""What each rule of the policy says of one finished audit."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal

from collaudit.core.config.schema import PolicyConfig
from collaudit.core.config.schema_policy import RuleName
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.policy_result import RuleOutcome, RuleState
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.findings import findings_with_level
from collaudit.core.history.log_record import LogRecord
from collaudit.core.policy.baseline import (
    Baseline,
    FrictionChange,
    change_over_nights,
    friction_change,
    known_level,
    known_rate,
    new_contacts,
)
from collaudit.core.verdict.coverage import seconds_text
from collaudit.core.verdict.noticed_words import place_text
from collaudit.core.verdict.verdict import contact_breach, counted, near_miss_breach, near_miss_rate

_DAY_S = 86400.0
_Level = Literal["warn", "error"]


@dataclass(frozen=True, slots=True)
class NightOfRobot:
    """What the logs of one robot have together: near misses, seconds recorded, and how many logs they are."""

    near_misses: int
    recorded_s: float
    logs: int

    @classmethod
    def of(cls, results: Sequence[AuditResult]) -> NightOfRobot:
        """The sums over audits."""
        recorded_s = sum(result.coverage.recorded_s for result in results)
        return cls(sum(len(result.near_misses) for result in results), recorded_s, len(results))


@dataclass(frozen=True, slots=True)
class LogInQuestion:
    """A finished audit, and what its policy needs to know besides.

    Attributes:
        result: of the log alone.
        policy: that holds for it.
        robot: whose it is; None without a fleet.
        place: its path or URL.
        folder: of its run.
        fitted_until: start of the newest log that its friction was fitted on, ISO 8601 UTC; None where unknown.
        own_fit: friction was fitted on the log itself.
        night: near misses, seconds recorded, and logs of its robot in the whole audit.
        record: of the log, where it is compared with the history in a store.
    """

    result: AuditResult
    policy: PolicyConfig
    robot: str | None
    place: str
    folder: str
    fitted_until: str | None
    own_fit: bool
    night: NightOfRobot
    record: LogRecord | None = None

    @property
    def near_misses_alone(self) -> list[str]:
        """Why its own near misses, by themselves, break the policy."""
        alone = NightOfRobot.of([self.result])
        return near_miss_breach(alone.near_misses, alone.recorded_s, self.policy.max_near_misses_per_hour)

    @property
    def where(self) -> str:
        """Words for the logs that near misses are counted in."""
        robot = "" if self.robot is None else f" of robot {self.robot}"
        return f", {self.night.logs} logs{robot}" if self.night.logs > 1 else ""


class RuleBook:
    """The rules, applied to one log."""

    def __init__(self, log: LogInQuestion, baseline: Baseline | None) -> None:
        self._log, self._result, self._policy = log, log.result, log.policy
        self._baseline = baseline
        self._before = baseline.before(log.robot, log.record) if baseline else ()

    def outcomes(self) -> list[RuleOutcome]:
        """What every rule says that has a limit, and is not switched off."""
        policy = self._policy
        rules: tuple[tuple[RuleName, Any, Callable[[_Level, Any], Iterator[RuleOutcome]]], ...] = (
            ("contacts", policy.max_collisions, self._contacts),
            ("near_misses", policy.max_near_misses_per_hour, self._near_misses),
            ("residual", policy.max_residual_rms_nm, self._residual),
            ("friction_change", policy.max_friction_change, self._friction),
            ("observable_time", policy.min_observable_s, self._observable),
            ("fit_age", policy.max_fit_age_days, self._age),
        )
        found: list[RuleOutcome] = []
        for name, limit, rule in rules:
            level = policy.levels.get(name, "error")
            if limit is not None and level != "off":
                found += rule(level, limit)
        return [*found, *self._findings()]

    def off(self) -> list[str]:
        """What rules say that are switched off and would be broken: a pass must not read as if nothing was found."""
        result, policy, texts = self._result, self._policy, list[str]()
        if policy.levels.get("contacts") == "off":
            texts += contact_breach(result.contacts, policy.max_collisions, result.findings)
        limit = policy.max_near_misses_per_hour
        if policy.levels.get("near_misses") == "off" and limit is not None:
            night = self._log.night
            texts += near_miss_breach(night.near_misses, night.recorded_s, limit, self._log.where)
        return [f"Switched off by the policy: {text}" for text in texts]

    def _contacts(self, level: _Level, most: int) -> Iterator[RuleOutcome]:
        result, found = self._result, self._result.contacts
        text = contact_breach(found, most, result.findings)
        state: RuleState = "broken" if text else "kept"
        note, value = None, len(found)
        if text and self._baseline is not None:
            spans = [(c.onset_s, c.end_s, c.joints) for c in found]
            new = new_contacts(spans, result.log.sha256, self._before)
            if new is not None:
                state, value = ("broken" if new > most else "known"), new
                note = f"baseline: {len(found) - new} of {len(found)} were in its audit of the same log"
        joints = tuple(sorted({joint for contact in found for joint in contact.joints}))
        words = " ".join(text) or f"{counted(len(found), 'contact')} (policy: at most {most})."
        yield RuleOutcome("contacts", level, state, words, joints, value, most, note)

    def _near_misses(self, level: _Level, limit: float) -> Iterator[RuleOutcome]:
        night = self._log.night
        count, hours = night.near_misses, night.recorded_s / 3600.0
        joints = tuple(sorted({near.joint for near in self._result.near_misses}))
        if hours <= 0:
            yield RuleOutcome("near_misses", level, "not_judged", "Nothing was recorded to count near misses in.")
            return
        broken = bool(joints and near_miss_breach(count, night.recorded_s, limit))
        note = known_rate(count, hours, limit, self._before) if broken else None
        state: RuleState = "kept" if not broken else "known" if note else "broken"
        words = near_miss_rate(count, night.recorded_s, limit, self._log.where)
        yield RuleOutcome("near_misses", level, state, words, joints, count / hours, limit, note)

    def _residual(self, level: _Level, limits: float | dict[str, float]) -> Iterator[RuleOutcome]:
        for joint in self._result.rule.watch:
            limit = limits.get(joint) if isinstance(limits, dict) else limits
            if limit is None:
                continue
            stats = self._result.residual.get(joint)
            value = None if stats is None else stats.rms_nm
            if value is None:
                text = f"Joint '{joint}' has no judged residual to compare with {limit:g} N·m."
                yield RuleOutcome("residual", level, "not_judged", text, (joint,), None, limit)
                continue
            text = f"Residual of joint '{joint}': {value:.3g} N·m RMS (policy: at most {limit:g})."
            broken = value > limit
            note = known_level(value, limit, joint, self._result.log.sha256, self._before) if broken else None
            state: RuleState = "kept" if not broken else "known" if note else "broken"
            yield RuleOutcome("residual", level, state, text, (joint,), value, limit, note)

    def _friction(self, level: _Level, limit: float) -> Iterator[RuleOutcome]:
        for joint in self._result.rule.watch:
            yield self._change_of(joint, level, limit)

    def _change_of(self, joint: str, level: _Level, limit: float) -> RuleOutcome:
        """A change beyond the limit with all of its interval is a breach; one within is none; else nobody can tell."""
        change = self._friction_change(joint)
        if isinstance(change, str):
            text = f"Change of friction of joint '{joint}' is not known: {change}."
            return RuleOutcome("friction_change", level, "not_judged", text, (joint,), None, limit)
        low, high = change.low, change.high
        smallest = 0.0 if low <= 0.0 <= high else min(abs(low), abs(high))
        state: RuleState = "not_judged"
        if smallest > limit:
            state = "broken"
        elif max(abs(low), abs(high)) <= limit:
            state = "kept"
        text = (
            f"Friction of joint '{joint}' changed by {100 * change.share:+.3g} % against the baseline, 95 % interval "
            f"{100 * low:+.3g} to {100 * high:+.3g} % (policy: at most {100 * limit:g} %)."
        )
        if state == "not_judged":
            text += " The interval includes the limit, so it is not known whether the limit is kept."
        return RuleOutcome("friction_change", level, state, text, (joint,), abs(change.share), limit)

    def _friction_change(self, joint: str) -> FrictionChange | str:
        if self._baseline is not None and self._baseline.of_nights and self._log.record is not None:
            return change_over_nights(joint, self._log.record, self._before)
        fits = [(log.start or "", log.friction[joint]) for log in self._before if joint in log.friction]
        now = self._result.friction.get(joint)
        if not fits or now is None:
            return "there is no baseline (--baseline)" if self._baseline is None else "the baseline has no fit of it"
        return friction_change(max(fits, key=lambda item: item[0])[1], now)

    def _observable(self, level: _Level, limit: float) -> Iterator[RuleOutcome]:
        found = list(_noticed(self._result))
        if not found:
            text = "What would have alarmed is not known: neither a force nor a torque is asked for."
            yield RuleOutcome("observable_time", level, "not_judged", text, (), None, limit)
        for what, joints, time_s in found:
            text = f"{what} would have alarmed for {seconds_text(time_s)} (policy: at least {seconds_text(limit)})."
            state: RuleState = "kept" if time_s >= limit else "not_judged"
            yield RuleOutcome("observable_time", level, state, text, joints, time_s, limit)

    def _age(self, level: _Level, limit: float) -> Iterator[RuleOutcome]:
        if self._log.own_fit:
            yield RuleOutcome("fit_age", level, "kept", "Friction was fitted on the log itself.", (), 0.0, limit)
            return
        stated = (self._result.log.start, self._log.fitted_until)
        log, fit = (None if text is None else datetime.fromisoformat(text) for text in stated)
        if log is None or fit is None:
            lacking = "The log does" if log is None else "The logs that friction was fitted on do"
            text = f"Age of the friction fit is not known: {lacking} not say when it was recorded."
            yield RuleOutcome("fit_age", level, "not_judged", text, (), None, limit)
            return
        days = (log - fit).total_seconds() / _DAY_S
        text = f"Friction was fitted on logs recorded {days:.3g} days before this one (policy: at most {limit:g})."
        yield RuleOutcome("fit_age", level, "broken" if days > limit else "kept", text, (), days, limit)

    def _findings(self) -> Iterator[RuleOutcome]:
        known = {one for log in self._before for one in log.findings}
        for finding, level in findings_with_level(self._result.findings, self._policy.findings):
            before = (finding.code, finding.joint) in known
            joints = () if finding.joint is None else (finding.joint,)
            note = "baseline: it has this finding, too" if before else None
            text = f"Finding {finding.code}: {finding.text}"
            yield RuleOutcome(finding.code, level, "known" if before else "broken", text, joints, note=note)


def _noticed(result: AuditResult) -> Iterator[tuple[str, tuple[str, ...], float]]:
    """What must alarm: its name, the joints that would have, and for how long it would have, s."""
    sensitivity = result.sensitivity or Sensitivity({})
    for force in sensitivity.forces:
        if force.asked is not None:
            yield f"{force.asked.force_n:.3g} N at {place_text(force)}", force.joints, force.asked.noticed_s
    for joint, s in sensitivity.joints.items():
        if s.asked is not None:
            unit = result.log.units.get(joint, "N·m")
            yield f"{s.asked.torque_nm:.3g} {unit} on joint '{joint}'", (joint,), s.asked.noticed_s
