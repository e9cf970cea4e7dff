"""The controller's alarms and the log's labels against the audit's contacts: agreed, missed, spurious, not judged."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.detection_result import Contact, ControllerAlarmComparison
from collaudit.core.data.joint_log import Annotation
from collaudit.core.data.signals import State
from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.vendors.controller_modes import state_of

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
