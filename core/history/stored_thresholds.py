"""Thresholds from the nights of a store: peaks of clean residuals add up, and support ever rarer false alarms."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.recommendation_result import ArmRate
from collaudit.core.errors import NotJudgedError
from collaudit.core.history.log_record import JointRecord, LogRecord
from collaudit.core.recommend.joint_thresholds import JointEvidence, arm_rate, tail_evidence, threshold
from collaudit.core.recommend.sustained_levels import LogPeaks, pooled_peaks


@dataclass(frozen=True, slots=True)
class StoredRule:
    """Threshold of one joint from all nights.

    Attributes:
        gamma_nm: recommended; None where the nights have no tail yet.
        n: samples.
        hours: clean time behind it.
        largest_clean_nm: largest level that lasted n samples.
        set_nm: threshold of the latest log; None where there is none.
    """

    gamma_nm: float | None
    n: int
    hours: float
    largest_clean_nm: float | None
    set_nm: float | None


@dataclass(frozen=True, slots=True)
class StoredRecommendation:
    """What the nights of one robot recommend and support.

    Attributes:
        robot: its name.
        logs, left_out: logs that count, and logs judged with another friction file, model, detector or persistence.
        nights: with a log that counts.
        joints: by name.
        rate: false alarms of the arm at the recommended thresholds.
        rate_set: at those of the latest log; None where a joint has none.
        supported_since: first night whose evidence, with all before it, supported the rate asked for at the recommended
            thresholds; ``set_supported_since`` at those that are set. None: not yet.
    """

    robot: str
    logs: int
    left_out: int
    nights: tuple[str, ...]
    joints: dict[str, StoredRule]
    rate: ArmRate
    rate_set: ArmRate | None
    supported_since: str | None
    set_supported_since: str | None


def stored_recommendation(records: Sequence[LogRecord], robot: str, per_hour: float) -> StoredRecommendation:
    """Thresholds for one robot from its records.

    Args:
        records: with their peaks.
        robot: its name.
        per_hour: false alarms of the arm that are accepted.

    Raises:
        NotJudgedError: no log of the robot was judged.
    """
    judged = [r for r in records if r.robot == robot and r.persistence_s is not None and r.joints]
    if not judged:
        raise NotJudgedError("the store holds no judged log of this robot", where="--robot", found=robot)
    judged.sort(key=lambda r: (r.night, r.start or "", r.log))
    latest = judged[-1]
    used = [r for r in judged if _settings(r) == _settings(latest)]
    nights = tuple(sorted({r.night for r in used}))
    found = _evidence(used)
    gammas = {joint: threshold(item.tail, per_hour, len(found)) for joint, item in found.items()}
    stated = {item.joint: item.gamma_nm for item in latest.joints if item.watched}
    own = [_evidence([r for r in used if r.night <= night]) for night in nights]
    return StoredRecommendation(
        robot=robot,
        logs=len(used),
        left_out=len(judged) - len(used),
        nights=nights,
        joints={
            joint: StoredRule(
                gamma_nm=gammas[joint],
                n=item.n,
                hours=item.peaks.hours,
                largest_clean_nm=None if item.tail is None else item.tail.largest_nm,
                set_nm=stated.get(joint),
            )
            for joint, item in found.items()
        },
        rate=_rate(found, gammas, per_hour),
        rate_set=None if None in stated.values() else _rate(found, stated, per_hour),
        supported_since=_since(nights, own, None, per_hour),
        set_supported_since=None if None in stated.values() else _since(nights, own, stated, per_hour),
    )


def _settings(record: LogRecord) -> tuple[object, ...]:
    return record.friction_sha256, record.model_sha256, record.detector, record.persistence_s


def _evidence(records: Sequence[LogRecord]) -> dict[str, JointEvidence]:
    joints = dict.fromkeys(item.joint for record in records for item in record.joints if item.watched)
    out = {}
    for joint in joints:
        own = [item for record in records for item in record.joints if item.joint == joint and item.watched]
        out[joint] = tail_evidence(pooled_peaks([_peaks(item) for item in own]), max(item.n for item in own))
    return out


def _peaks(item: JointRecord) -> LogPeaks:
    """Peaks of a log; those that were not kept are taken to be as large as the smallest that was."""
    level, minute = np.array(item.peaks_nm), np.array(item.peaks_minute, dtype=np.int64)
    lost, minutes = max(0, item.peaks_count - level.size), max(1, len(item.minute_hours))
    if lost and level.size:
        level = np.concatenate([level, np.full(lost, level.min())])
        minute = np.concatenate([minute, np.arange(lost, dtype=np.int64) % minutes])
    return LogPeaks(level, np.zeros(level.size), minute, np.array(item.minute_hours))


def _rate(found: Mapping[str, JointEvidence], gammas: Mapping[str, float | None], per_hour: float) -> ArmRate:
    """The arm's rate; a joint without a tail makes the whole unsupported, for nothing is known of it."""
    rate = arm_rate(found, gammas, per_hour)
    known = all(item.tail is not None for item in found.values())
    return rate if known else replace(rate, supported=False)


def _since(
    nights: Sequence[str],
    own: Sequence[Mapping[str, JointEvidence]],
    stated: Mapping[str, float | None] | None,
    per_hour: float,
) -> str | None:
    """The first night from which on, to the last, the evidence supports the rate."""
    since = None
    for night, found in zip(nights, own, strict=True):
        gammas = stated or {joint: threshold(item.tail, per_hour, len(found)) for joint, item in found.items()}
        supported = bool(found) and _rate(found, gammas, per_hour).supported
        since = (since or night) if supported else None
    return since
