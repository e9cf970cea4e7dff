"""From alarms of single joints to contacts: which link, how strong, meant or not."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.contacts.contact_kind import classify
from collaudit.core.contacts.external_force import estimate_force, residual_noise
from collaudit.core.data.audit_result import Collision
from collaudit.core.data.detection_result import Contact
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.prepared import Prepared, judged_series

#: Alarms of different joints closer than this are one contact.
_TOGETHER_S = 0.1


def find_contacts(prepared: Prepared, found: DetectorRun, config: Config) -> tuple[Contact, ...]:
    """Group the alarms of all joints into contacts and describe each.

    Args:
        prepared: the log and its model.
        found: the evaluation.
        config: phases and wrench settings.
    """
    groups = _groups(found.detected.collisions)
    noise = residual_noise(prepared, found) if groups else np.zeros(0)
    return tuple(_describe(prepared, found, noise, group, config) for group in groups)


def _groups(collisions: Sequence[Collision]) -> list[list[Collision]]:
    groups: list[list[Collision]] = []
    end = -np.inf
    for alarm in sorted(collisions, key=lambda c: c.onset_s):
        if alarm.onset_s > end + _TOGETHER_S:
            groups.append([])
            end = -np.inf
        groups[-1].append(alarm)
        end = max(end, alarm.onset_s + alarm.duration_s)
    return groups


def _describe(
    prepared: Prepared, found: DetectorRun, noise_nm: FloatArray, group: Sequence[Collision], config: Config
) -> Contact:
    series, robot = judged_series(prepared), prepared.robot
    names = [joint for joint in series.joint_names if any(c.joint == joint for c in group)]
    onset, end = min(c.onset_s for c in group), max(c.onset_s + c.duration_s for c in group)
    peak = _peak_sample(prepared, found, group)
    scalar = found.balance.engine.scalar
    outer = robot.joint_names.index(names[-1])
    beyond = [j for j in series.joint_names if robot.joint_names.index(j) > outer]
    blind = [j for j in beyond if found.detected.state[peak, series.column(j)] > State.JUDGED]
    link = "unknown" if scalar else robot.link_of(names[-1]) or f"the link moved by {names[-1]}"
    force = None if scalar else estimate_force(prepared, found, noise_nm, names, peak)
    kind, evidence = classify(prepared, found, group, force, config)
    return Contact(
        onset_s=onset,
        detected_s=min(c.detected_s for c in group),
        end_s=end,
        joints=tuple(names),
        link=link,
        link_note=_note(scalar, beyond, blind),
        force=force,
        kind=kind,
        evidence=evidence,
    )


def _peak_sample(prepared: Prepared, found: DetectorRun, group: Sequence[Collision]) -> int:
    """Sample at which the joints' residuals, each over its threshold, are largest together.

    Of the samples at which most joints are evidence: a joint within its friction interval shows only a part of its
    torque, and when it did not alarm nothing at all.
    """
    series = judged_series(prepared)
    onset, end = min(c.onset_s for c in group), max(c.onset_s + c.duration_s for c in group)
    a, b = (int(k) for k in np.searchsorted(series.time_s, [onset, end]))
    part = slice(a, max(b, a + 1))
    columns = [series.column(c.joint) for c in group]
    level = np.stack([found.threshold.of(j, part) for j in columns], axis=1)
    ratio = np.abs(found.residual.torque_nm[part][:, columns]) / level
    judged = np.count_nonzero(found.detected.state[part] == State.JUDGED, axis=1)
    return a + int(np.argmax(np.where(judged == judged.max(), np.nan_to_num(ratio).sum(axis=1), -1.0)))


def _note(scalar: bool, beyond: Sequence[str], blind: Sequence[str]) -> str:
    if scalar:
        return "This detector sees power only and does not isolate."
    if not beyond:
        return "The outermost judged joint reacted: the contact is at its link or further out."
    text = f"Not further in; {', '.join(beyond)} did not react"
    if blind:
        text += f" ({', '.join(blind)} could not have shown it)"
    return text + ": a force through their axes would not show, so the contact may be further out."
