"""A controller's own alarms (contact, collision, stop) in the fields of its joint states."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.logs.messages.decoded_columns import Decoded
from collaudit.core.logs.signals.annotation_spans import spans_of
from collaudit.core.logs.signals.sample_clock import Clock
from collaudit.core.logs.signals.stamps import seconds_since
from collaudit.core.numeric.arrays import BoolArray, IntArray
from collaudit.core.vendors.message_profiles import ANNOTATION, Profile


@dataclass(frozen=True, slots=True, eq=False)
class AlarmField:
    """One alarm, in one kind of message.

    Attributes:
        name: of the alarm.
        joints: joint of each column; empty when the alarm belongs to the whole arm.
        log_ns: (n,) recording times.
        stamp_ns: (n,) header stamps, or None.
        raised: (n, m) True while it is raised.
    """

    name: str
    joints: tuple[str, ...]
    log_ns: IntArray
    stamp_ns: IntArray | None
    raised: BoolArray


def alarm_fields(decoded: Decoded, profile: Profile | None) -> list[AlarmField]:
    """The alarms of a topic that were ever raised; to be asked before its groups are used up."""
    out = []
    for group in decoded.groups.values():
        names = [key for key in group.columns if key.startswith(ANNOTATION)]
        if not names:
            continue
        at = np.argsort(np.asarray(group.look("place")), kind="stable")
        for name in names:
            values = np.asarray(group.take(name), dtype=np.float64)
            if profile is None or not (raised := profile.raised(name.removeprefix(ANNOTATION), values)).any():
                continue
            log_ns = np.asarray(group.look("log_ns"), dtype=np.int64)
            stamps = group.look("stamp_ns")
            stamp_ns = None if stamps is None else np.asarray(stamps, dtype=np.int64)[at]
            joints = group.key.names if raised.shape[1] == len(group.key.names) else ()
            out.append(AlarmField(name.removeprefix(ANNOTATION), joints, log_ns[at], stamp_ns, raised[at]))
    return out


def alarm_annotations(fields: list[AlarmField], clock: Clock, origin_ns: int, topic: str) -> list[Annotation]:
    """The alarms as annotations, one a joint; each stretch ends at the last stamp at which the alarm was raised.

    Args:
        fields: of the topic.
        clock: the clock of its samples.
        origin_ns: time zero of that clock.
        topic: their source.
    """
    found: dict[tuple[str, str | None], list[tuple[float, float]]] = {}
    for field in fields:
        stamps = field.stamp_ns if clock == "header" and field.stamp_ns is not None else field.log_ns
        time_s = seconds_since(stamps, origin_ns)
        columns: list[tuple[str | None, BoolArray]] = [
            (joint, field.raised[:, k]) for k, joint in enumerate(field.joints)
        ]
        for joint, raised in columns or [(None, np.asarray(field.raised.any(axis=1)))]:
            found.setdefault((field.name, joint), []).extend(spans_of(time_s, raised))
    return [Annotation(name, topic, tuple(sorted(spans)), joint) for (name, joint), spans in found.items() if spans]
