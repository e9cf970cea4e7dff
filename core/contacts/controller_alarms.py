"""The controller's own collision alarms against the audit's: agreed, missed, spurious, early or late."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.arm_states.state_names import state_of
from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.detection_result import Contact, ControllerAlarmComparison
from collaudit.core.data.joint_log import Annotation
from collaudit.core.data.uniform_series import UniformSeries

#: An alarm belongs to a contact from this long before its onset to this long after its end.
_BEFORE_S, _AFTER_S = 0.1, 0.5


def compare_controller_alarms(
    controller_alarms_s: Sequence[float], contacts: Sequence[Contact]
) -> tuple[ControllerAlarmComparison, ...]:
    """Match each controller alarm with the contact it falls into.

    A second alarm within one contact is part of it. Without any controller alarms nothing is compared: a log that has
    no such signal has not missed anything.

    Args:
        controller_alarms_s: times of the controller's alarms, s.
        contacts: ours, in time order.
    """
    if not controller_alarms_s:
        return ()
    out: list[ControllerAlarmComparison] = []
    unmatched = list(contacts)
    for alarm_s in sorted(controller_alarms_s):
        contact = next((c for c in contacts if c.onset_s - _BEFORE_S <= alarm_s <= c.end_s + _AFTER_S), None)
        if contact is None:
            out.append(ControllerAlarmComparison(alarm_s, None, "spurious", None))
        elif contact in unmatched:
            unmatched.remove(contact)
            lead_s = alarm_s - contact.detected_s
            out.append(ControllerAlarmComparison(alarm_s, contact.detected_s, "agreed", lead_s))
    out += [ControllerAlarmComparison(None, c.detected_s, "missed", None) for c in unmatched]
    return tuple(sorted(out, key=lambda f: f.flag_s if f.flag_s is not None else f.detected_s or 0.0))


def controller_alarms_s(series: UniformSeries, config: DetectConfig) -> list[float]:
    """When the controller raised an alarm, s: as configured, and where the log's other labels begin."""
    labelled = {
        start
        for label in series.annotations
        if not is_named(label, config.true_events) and state_of(label.name) not in ("guided", "off")
        for start, _ in label.intervals_s
    }
    return sorted(labelled | set(config.controller_alarms_s))


def is_named(label: Annotation, names: Sequence[str]) -> bool:
    """Whether an annotation is meant by one of the names: by its own or by its source."""
    return label.name in names or label.source in names
