"""The controller's own collision alarms against the audit's: agreed, missed, spurious, early or late."""

from __future__ import annotations

from collections.abc import Sequence

from collaudit.core.data.detection_result import Contact, ControllerAlarmComparison

#: An alarm belongs to an incident from this long before its onset to this long after its end.
_BEFORE_S, _AFTER_S = 0.1, 0.5


def compare_controller_alarms(
    flags_s: Sequence[float], incidents: Sequence[Contact]
) -> tuple[ControllerAlarmComparison, ...]:
    """Match each controller alarm with the incident it falls into.

    A second alarm within one incident is part of it. Without any flags nothing is compared: a log that has no
    such signal has not missed anything.

    Args:
        flags_s: times of the controller's alarms, s.
        incidents: ours, in time order.
    """
    if not flags_s:
        return ()
    out: list[ControllerAlarmComparison] = []
    left = list(incidents)
    for flag in sorted(flags_s):
        its = next((i for i in incidents if i.onset_s - _BEFORE_S <= flag <= i.end_s + _AFTER_S), None)
        if its is None:
            out.append(ControllerAlarmComparison(flag, None, "spurious", None))
        elif its in left:
            left.remove(its)
            out.append(ControllerAlarmComparison(flag, its.detected_s, "agreed", flag - its.detected_s))
    out += [ControllerAlarmComparison(None, i.detected_s, "missed", None) for i in left]
    return tuple(sorted(out, key=lambda f: f.flag_s if f.flag_s is not None else f.detected_s or 0.0))
