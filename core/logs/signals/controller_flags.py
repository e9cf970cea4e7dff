"""A controller's own flags (contact, collision), as data and as findings with their place and joint."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from collaudit.core.data.joint_log import Annotation
from collaudit.core.findings import Finding
from collaudit.core.logs.messages.message_tables import Decoded
from collaudit.core.logs.messages.profiles import LABEL, Profile
from collaudit.core.logs.signals.publishers import seconds_since
from collaudit.core.logs.signals.sample_clock import Clock
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray

#: Flags that come and go more often than this are counted, not listed.
LISTED = 100


@dataclass(frozen=True, slots=True, eq=False)
class Flags:
    """One label of one kind of message.

    Attributes:
        label: its name.
        joints: joint of each column; empty when the flag belongs to the whole arm.
        log_ns: (n,) recording times.
        stamp_ns: (n,) header stamps, or None.
        raised: (n, m) True while it holds.
    """

    label: str
    joints: tuple[str, ...]
    log_ns: IntArray
    stamp_ns: IntArray | None
    raised: BoolArray


def flags_of(decoded: Decoded, profile: Profile | None) -> list[Flags]:
    """The flags of a topic that were ever raised; to be asked before its groups are used up."""
    out = []
    for group in decoded.groups.values():
        names = [key for key in group.columns if key.startswith(LABEL)]
        if not names:
            continue
        at = np.argsort(np.asarray(group.look("order")), kind="stable")
        for name in names:
            values = np.asarray(group.take(name), dtype=np.float64)
            if profile is None or not (raised := profile.raised(name.removeprefix(LABEL), values)).any():
                continue
            log_ns = np.asarray(group.look("log_ns"), dtype=np.int64)
            stamps = group.look("stamp_ns")
            stamp_ns = None if stamps is None else np.asarray(stamps, dtype=np.int64)[at]
            joints = group.key.names if raised.shape[1] == len(group.key.names) else ()
            out.append(Flags(name.removeprefix(LABEL), joints, log_ns[at], stamp_ns, raised[at]))
    return out


def labels_of(flags: list[Flags], clock: Clock, origin_ns: int, topic: str) -> list[Annotation]:
    """The flags as labels, one a joint; each stretch ends at the last stamp at which the flag was up.

    Args:
        flags: of the topic.
        clock: the clock of its samples.
        origin_ns: time zero of that clock.
        topic: their source.
    """
    found: dict[tuple[str, str | None], list[tuple[float, float]]] = {}
    for flag in flags:
        stamps = flag.stamp_ns if clock == "header" and flag.stamp_ns is not None else flag.log_ns
        time_s = seconds_since(stamps, origin_ns)
        columns: list[tuple[str | None, BoolArray]] = [
            (joint, flag.raised[:, k]) for k, joint in enumerate(flag.joints)
        ]
        for joint, raised in columns or [(None, np.asarray(flag.raised.any(axis=1)))]:
            found.setdefault((flag.label, joint), []).extend(held(time_s, raised))
    return [Annotation(name, topic, tuple(sorted(its)), joint) for (name, joint), its in found.items() if its]


def held(time_s: FloatArray, raised: BoolArray) -> list[tuple[float, float]]:
    """(first, last) stamp of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], raised, [False]]).astype(np.int8)))
    return [(float(time_s[start]), float(time_s[stop - 1])) for start, stop in edges.reshape(-1, 2).tolist()]


def label_findings(labels: list[Annotation]) -> list[Finding]:
    """One finding for each time a flag was up."""
    findings = []
    for label in labels:
        of = f" of {label.joint}" if label.joint else ""
        for first, last in label.intervals_s:
            text = f"The log itself says {label.name}{of} from {first:.4g} s to {last:.4g} s."
            findings.append(Finding("log-label", "info", text, label.source, label.joint, first, last))
    if len(findings) > LISTED:
        text = f"Flags are raised {len(findings) - LISTED} more times."
        findings = [*findings[:LISTED], Finding("log-label", "info", text)]
    return findings
