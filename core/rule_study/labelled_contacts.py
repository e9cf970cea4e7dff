"""Known contacts of a log against its rule, beside contacts that are added to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.data.rule_study_result import LabelledCurve
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.rule_study.alarm_grid import excess, sustained_level
from collaudit.core.rule_study.arm_contacts import AddedContacts, watched_columns, wilson_interval
from collaudit.core.rule_study.shown_torque import shown

#: Start and end of contacts, s.
Times = Sequence[tuple[float, float]]
#: Factors on the thresholds, and forces of the added contacts, N.
_SCALES = np.geomspace(0.25, 16.0, 25)
FORCES_N = (5.0, 10.0, 20.0, 40.0)
#: A person's label begins a little late.
_EARLY_S, _LATE_S = 0.1, 0.1


def labelled_curve(
    prepared: Prepared, run: DetectorRun, inputs: DetectionInputs, contact: Times, added: AddedContacts | None
) -> LabelledCurve | None:
    """How many known contacts a rule misses as its thresholds rise; None where none of them was judged.

    Args:
        prepared, run, inputs: the log.
        contact: start and end of each known contact, s.
        added: pushes that were added to the same log.
    """
    series, names = prepared.judged_series, prepared.judged_series.joint_names
    columns, n = watched_columns(inputs, names), inputs.rule.n
    gamma = np.array([inputs.rule.gamma_nm[names[j]] for j in columns])
    state = run.detected.state
    reached = []
    for start, end in contact:
        a, b = (int(x) for x in np.searchsorted(series.time_s, [start - _EARLY_S, end + _LATE_S]))
        evidence = np.asarray(state[a:b, columns] <= State.FRICTION_INTERVAL)
        if not evidence.any() or not columns:
            continue
        found = np.stack(
            [
                excess(run.residual.torque_nm[a:b, j], run.residual.uncertainty_nm[a:b, j], evidence[:, k])
                for k, j in enumerate(columns)
            ]
        )
        reached.append(float((sustained_level(found, np.array([n]))[:, 0] / gamma).max()))
    if not reached:
        return None
    needed = np.array(reached)
    missed = [int(np.count_nonzero(needed <= scale)) for scale in _SCALES]
    return LabelledCurve(
        scale=tuple(float(f"{x:.4g}") for x in _SCALES),
        contacts=needed.size,
        missed=tuple(m / needed.size for m in missed),
        missed_ci95=tuple(wilson_interval(m, needed.size) for m in missed),
        injected={} if added is None else {f"{force:g}": _missed(added, force, gamma, n) for force in FORCES_N},
    )


def _missed(added: AddedContacts, force_n: float, gamma: FloatArray, n: int) -> tuple[float, ...]:
    """Share of the added contacts that a force leaves unnoticed, at each factor."""
    level = sustained_level(shown(added.around, force_n * added.unit_nm), np.array([n]))[..., 0]
    reached = (level / gamma[:, None]).max(axis=0)
    return tuple(float(np.mean(reached <= scale)) for scale in _SCALES)
