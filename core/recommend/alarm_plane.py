"""False alarms of each joint over threshold gamma and persistence, counted in the clean time of its runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.cycles.null_level import NullEvidence
from collaudit.core.data.audit_result import RecommendedRule
from collaudit.core.data.recommendation_result import SetRule
from collaudit.core.detection.rule import MERGE_S, persistence_samples
from collaudit.core.numeric.arrays import FloatArray, IntArray, run_bounds
from collaudit.core.recommend.arm_evidence import ArmEvidence

#: Thresholds and persistences of the plane, as multiples of the rule that it is drawn around.
GAMMAS: tuple[float, ...] = tuple(2.0 ** (k / 2) for k in range(-4, 5))
PERSISTENCES: tuple[float, ...] = (0.25, 0.5, 1.0, 2.0, 4.0)


@dataclass(frozen=True, slots=True)
class AlarmPlane:
    """Alarms of one joint at constant thresholds. The table is (threshold, persistence).

    Attributes:
        gamma_nm: (g,) thresholds, rising, N·m (N if prismatic).
        persistence_s: (c,) rising.
        clean_s: judged time away from contact that the alarms were counted in.
        alarms: (g, c) their number in it; closer than 0.2 s they are one.
        set_nm, recommended_nm: thresholds to mark; None where there is none.
    """

    gamma_nm: tuple[float, ...]
    persistence_s: tuple[float, ...]
    clean_s: float
    alarms: tuple[tuple[int, ...], ...]
    set_nm: float | None
    recommended_nm: float | None


def alarm_planes(
    evidence: ArmEvidence,
    rules: Mapping[str, RecommendedRule],
    set_rules: Mapping[str, SetRule],
    persistence_s: float,
) -> dict[str, AlarmPlane]:
    """The plane of every joint with a threshold, around the recommended one, or the set one where none is recommended.

    Args:
        evidence: of all logs.
        rules: recommended.
        set_rules: as set.
        persistence_s: that the rules are for.
    """
    planes = {}
    for joint in evidence.joints:
        set_nm = set_rules[joint].gamma_nm if joint in set_rules else None
        recommended_nm = rules[joint].gamma_nm if joint in rules else None
        around_nm = recommended_nm or set_nm
        if not around_nm:
            continue
        gammas = np.array([float(f"{around_nm * ratio:.3g}") for ratio in GAMMAS])
        lasting = tuple(persistence_s * ratio for ratio in PERSISTENCES)
        data = evidence.of_joint(joint)
        counted = np.sum([_counted(one, gammas, lasting) for one in data], axis=0)
        clean_s = float(sum(np.count_nonzero(one.moving) * one.period_s for one in data))
        alarms = tuple(tuple(int(x) for x in row) for row in counted)
        planes[joint] = AlarmPlane(tuple(gammas.tolist()), lasting, clean_s, alarms, set_nm, recommended_nm)
    return planes


def _counted(data: NullEvidence, gammas: FloatArray, lasting_s: Sequence[float]) -> IntArray:
    residual = np.where(data.moving, np.abs(data.residual_nm), -np.inf)
    counts = np.array([persistence_samples(length, data.period_s) for length in lasting_s])
    return alarm_counts(residual, gammas, counts, round(MERGE_S / data.period_s))


def alarm_counts(level_nm: FloatArray, gammas: FloatArray, counts: IntArray, merge: int) -> IntArray:
    """(g, c) alarms of rule (6) for each threshold and persistence.

    Args:
        level_nm: (n,) size of the residual, -inf where nothing can alarm, N·m.
        gammas: (g,) thresholds, N·m.
        counts: (c,) persistences, samples, rising.
        merge: alarms with fewer samples between them are one.
    """
    out = np.zeros((gammas.size, counts.size), dtype=np.int64)
    for g, gamma in enumerate(gammas):
        starts, stops = run_bounds(level_nm > gamma)
        for c, n in enumerate(counts):
            long = stops - starts >= n
            starts, stops = starts[long], stops[long]
            if starts.size == 0:
                break
            out[g, c] = 1 + np.count_nonzero(starts[1:] - stops[:-1] >= max(1, merge))
    return out
