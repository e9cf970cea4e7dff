"""Whether the events of a run are those of its signals; they are not where one of the files was edited."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.signals import State
from collaudit.core.detection.rule import MERGE_S, Event, both_events
from collaudit.core.errors import CollauditError
from collaudit.reports.files.signals_file import StoredSignals

#: Onset, end, joint and peak of an alarm; end is 0 of a near miss.
_Counted = tuple[float, float, str, float]
#: Peaks differ by less: they are stored in steps far below gamma.
_PEAK_SHARE = 0.05


def check_events(run_dir: Path, result: AuditResult, signals: StoredSignals) -> None:
    """Apply the rule of a result to the signals beside it.

    Args:
        run_dir: for messages.
        result: of ``audit.json``.
        signals: of ``signals.parquet``.

    Raises:
        CollauditError: other alarms or near misses follow from the signals.
    """
    alarms: list[_Counted] = []
    near: list[_Counted] = []
    period = result.log.sample_period_s or 0.0
    for joint, fired, close in _recounted(result, signals):
        for event in fired:
            onset = float(signals.time_s[event.span.start])
            alarms.append((onset, onset + len(event.span) * period, joint, event.peak))
        near += [(float(signals.time_s[event.span.start]), 0.0, joint, event.peak) for event in close]
    written = [(c.onset_s, c.onset_s + c.duration_s, c.joint, c.peak_nm) for c in result.collisions]
    nearly = [(m.onset_s, 0.0, m.joint, m.peak_nm) for m in result.near_misses]
    _compare(run_dir, "alarms", alarms, written, 0.5 * period)
    _compare(run_dir, "near misses", near, nearly, 0.5 * period)


def _recounted(result: AuditResult, signals: StoredSignals) -> Iterator[tuple[str, list[Event], list[Event]]]:
    """Joint, alarms and near misses of each watched joint."""
    rule, merge = result.rule, round(MERGE_S / (result.log.sample_period_s or MERGE_S))
    for joint in (one for one in rule.watch if one in signals.joint_names and one in rule.gamma_nm):
        gamma = signals.read(f"gamma_nm:{joint}")
        evidence = signals.states(joint) <= State.FRICTION_INTERVAL
        near = gamma - np.float32(rule.below_gamma_nm(joint))
        residual = signals.read(f"residual_nm:{joint}").astype(np.float64)
        cycle = None
        if signals.has(f"cycle_nm:{joint}"):
            cycle = signals.read(f"cycle_nm:{joint}").astype(np.float64), signals.read(f"cycle_gamma_nm:{joint}")
        told = both_events((residual, gamma, near), cycle, evidence, rule.n, rule.near_miss_persistence, merge)
        fired, low, brief = ([event for event, _ in its] for its in told)
        yield joint, fired, [*low, *brief]


def _compare(run_dir: Path, what: str, found: Sequence[_Counted], stated: Sequence[_Counted], slack_s: float) -> None:
    """Refuse events that differ in number, time, joint or peak."""
    if len(found) != len(stated):
        raise _contradiction(run_dir, f"{len(stated)} {what}", f"{len(found)}")
    for (onset, end, joint, peak), (its_onset, its_end, its_joint, its_peak) in zip(
        sorted(found), sorted(stated), strict=True
    ):
        same = abs(onset - its_onset) <= slack_s and abs(end - its_end) <= slack_s
        same &= abs(peak - its_peak) <= _PEAK_SHARE * abs(peak)
        if not same or joint != its_joint:
            raise _contradiction(
                run_dir,
                f"{what} at {its_onset:.6g} s of {its_peak:.4g} N·m ({its_joint})",
                f"at {onset:.6g} s of {peak:.4g} N·m ({joint})",
            )


def _contradiction(run_dir: Path, written: str, counted: str) -> CollauditError:
    return CollauditError(
        "audit.json contradicts signals.parquet: no report is written",
        where=str(run_dir),
        found=f"{written} in audit.json",
        expected=f"{counted} by its rule, applied to the signals",
        hint="one of the files was changed, or is of another run: audit the log again",
    )
