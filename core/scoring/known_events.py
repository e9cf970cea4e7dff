"""What is known about a log's events from outside the residual: true events to score by, the controller's alarms.

Alarms and labels that are no true events are held against the audit's contacts: agreed, missed, spurious, not judged.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from collaudit.core.config.schema import Config, DetectConfig
from collaudit.core.data.detection_result import Contact, ControllerAlarmComparison, Score
from collaudit.core.data.joint_log import Annotation, UniformSeries
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.errors import ConfigError
from collaudit.core.findings import Finding
from collaudit.core.logs.signals.annotation_spans import absent_labels
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.scoring.detection_score import JudgedResidual, TrueEvent, TruthFile, score, true_events
from collaudit.core.vendors.vendor_words import state_of


def score_detection(
    series: UniformSeries, run: DetectorRun, inputs: DetectionInputs, config: DetectConfig, truth: TruthFile | None
) -> tuple[Score, ...]:
    """Score a detector against the known events; empty when none are known, as in a log without such a label.

    Args:
        series: the judged joints.
        run: what the detector made of them.
        inputs: the rule and the watched joints.
        config: labels of the log that mark true events.
        truth: a truth file or table of labels, which wins over the log's own.

    Raises:
        LogError: the file cannot be understood.
    """
    labels = [label for label in series.annotations if is_named(label, config.true_events)]
    if truth is None and not labels:
        return ()
    watched = inputs.rule.watch
    joints = watched or series.joint_names  # of no watched joint: they happened, and none could be observed
    if truth is not None:
        events = true_events(truth, joints)
    else:
        events = [
            TrueEvent(start, end, dict.fromkeys([label.joint] if label.joint else joints, None), label.joint is None)
            for label in labels
            for start, end in label.intervals_s
        ]
    ratio = run.residual.torque_nm / run.gamma_nm
    judged = JudgedResidual(series.time_s, ratio, run.detected.state, series.joint_names, inputs.rule.n)
    return tuple(s for s in score(events, run.detected.collisions, judged) if s.joint is None or s.joint in watched)


def known_contact_times(
    prepared: Sequence[Prepared], config: Config, truth: Sequence[TruthFile | None]
) -> list[list[tuple[float, float]] | None]:
    """For each log the start and end of its known contacts, s; None where they are not known and are to be looked for.

    Args:
        prepared: the logs.
        config: ``[fit] contact`` and the labels of ``[detect] true_events``.
        truth: for each log a truth file or table of labels, which wins over the log's own labels.

    Raises:
        LogError: a file cannot be understood.
        ConfigError: contacts are stated to be labelled, and a log has no such label.
    """
    wanted, how = config.detect.true_events, config.fit.contact
    if how == "labelled" and not wanted and not any(truth):
        raise ConfigError(
            "no labels are named that mark contact",
            where="[fit] contact",
            found='"labelled" without [detect] true_events and without a truth file',
            hint="name the labels in [detect] true_events, or give --truth",
        )
    out: list[list[tuple[float, float]] | None] = []
    for log, file in zip(prepared, [*truth, *[None] * (len(prepared) - len(truth))], strict=True):
        if file is not None:
            out.append(contact_times(file, log.judged))
            continue
        times = label_times(log.series.annotations, wanted) if how != "none" else None
        if times is None and how == "labelled":
            names = dict.fromkeys(label.name for label in log.series.annotations)
            raise ConfigError(
                "the log has no such label",
                where='[fit] contact = "labelled"',
                found=", ".join(wanted),
                expected="some of " + (", ".join(names) or "none at all"),
                hint="collaudit inspect LOG lists topics; [log] names those that hold labels",
            )
        out.append(times)
    return out


def contact_times(truth: TruthFile, joints: Sequence[str]) -> list[tuple[float, float]]:
    """Start and end of all events of a truth file or table of labels, s.

    Raises:
        LogError: it cannot be understood.
    """
    return [(event.onset_s, event.end_s) for event in true_events(truth, joints)]


def label_times(labels: Sequence[Annotation], wanted: Sequence[str]) -> list[tuple[float, float]] | None:
    """Start and end of what a log's labels of these names or sources mark, s; None without such a label."""
    marks = [label for label in labels if is_named(label, wanted)]
    return sorted(interval for label in marks for interval in label.intervals_s) if marks else None


def missing_labels(series: UniformSeries, config: Config) -> list[Finding]:
    """That the log lacks labels which mark true events; of columns and topics of labels its reader says so."""
    names = [name for name in config.detect.true_events if name not in config.log.labels]
    absent = [name for name in names if not any(is_named(one, [name]) for one in series.annotations)]
    return absent_labels(absent, "[detect] true_events", series.source.name)


#: A mark belongs to a contact from this long before its onset to this long after its end.
_BEFORE_S, _AFTER_S = 0.1, 0.5


class Mark(NamedTuple):
    """A moment that somebody else marked, s, and the name of the label in the log."""

    time_s: float
    label: str


def controller_alarms(
    series: UniformSeries, run: DetectorRun, inputs: DetectionInputs, config: DetectConfig, contacts: Sequence[Contact]
) -> tuple[ControllerAlarmComparison, ...]:
    """The controller's alarms and the labels of a log beside the contacts that were found in it.

    Marks are where labels begin that are no true events. An alarm was possible where at least half of the watched
    joints were judged, by value or by the range of friction.
    """
    marks = {
        Mark(start, label.name)
        for label in series.annotations
        if not is_named(label, config.true_events) and state_of(label.name) not in ("guided", "off")
        for start, _ in label.intervals_s
    }
    watched = [series.column(joint) for joint in inputs.rule.watch]
    judged = np.zeros(series.time_s.size, dtype=np.int16)
    for k in watched:
        judged += run.detected.state[:, k] <= State.FRICTION_INTERVAL
    telling = np.asarray(judged >= max(1.0, 0.5 * len(watched)))
    return compare_controller_alarms(sorted(marks), contacts, series.time_s, telling)


def compare_controller_alarms(
    marks: Sequence[Mark], contacts: Sequence[Contact], time_s: FloatArray, telling: BoolArray
) -> tuple[ControllerAlarmComparison, ...]:
    """Match each mark with the contact it falls into.

    A second mark within one contact is part of it. Without any marks nothing is compared: a log that has no such signal
    has not missed anything. A mark without a contact is spurious only where one would have been noticed for most of the
    time around it.

    Args:
        marks: the controller's alarms and the log's labels.
        contacts: ours, in time order.
        time_s: (n,) of the log.
        telling: (n,) whether an alarm was possible.
    """
    if not marks:
        return ()
    out: list[ControllerAlarmComparison] = []
    unmatched = list(contacts)
    for mark in sorted(marks, key=lambda m: m.time_s):
        contact = next((c for c in contacts if c.onset_s - _BEFORE_S <= mark.time_s <= c.end_s + _AFTER_S), None)
        if contact is None:
            a, b = np.searchsorted(time_s, [mark.time_s - _AFTER_S, mark.time_s + _BEFORE_S])
            known = b > a and np.count_nonzero(telling[a:b]) >= 0.5 * (b - a)
            out.append(
                ControllerAlarmComparison(mark.time_s, None, "spurious" if known else "not-judged", None, mark.label)
            )
        elif contact in unmatched:
            unmatched.remove(contact)
            lead_s = mark.time_s - contact.detected_s
            out.append(ControllerAlarmComparison(mark.time_s, contact.detected_s, "agreed", lead_s, mark.label))
    out += [ControllerAlarmComparison(None, c.detected_s, "missed", None) for c in unmatched]
    return tuple(sorted(out, key=lambda f: f.flag_s if f.flag_s is not None else f.detected_s or 0.0))


def is_named(label: Annotation, names: Sequence[str]) -> bool:
    """Whether an annotation is meant by one of the names: by its own or by its source."""
    return label.name in names or label.source in names
