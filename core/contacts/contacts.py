"""From single joints to events of the arm: alarms that are one contact, on which link, how strong, commanded or not.

Steps of standing joints that are no contact already, and belong together, are disturbances of an arm at rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.contacts.contact_scene import ArmAtSamples, after_contact, scene_at
from collaudit.core.contacts.external_force import Unsmoothed, estimate_force, least_force, with_least, without_guess
from collaudit.core.data.audit_result import Collision
from collaudit.core.data.detection_result import Contact, ContactForce, ContactKind, LeastForce, RestDisturbance
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.findings import Finding
from collaudit.core.findings.finding_kinds import Severity
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.prepare.phases import PHASES
from collaudit.core.prepare.prepared import Prepared

#: Contacts that rise faster than this are blows, slower than that are leaning on.
_FAST_RISE_S, _SLOW_RISE_S = 0.1, 0.4
#: Shares of a contact's torque variation above 5 Hz: more speaks for a blow, less for a force that is applied.
_HIGH_SHARE, _LOW_SHARE, _HIGH_HZ = 0.3, 0.05, 5.0
#: A contact's rise is looked for from this long before its onset; its spectrum spans this much on both sides.
_BEFORE_RISE_S, _SPECTRUM_MARGIN_S = 0.3, 0.1
#: Cosine of the angle between two forces that count as one direction.
_ALIGNED = 0.8
_SAFE_SCORE = 2
#: A vote that no slow and smooth shape outweighs: outside contact no force is commanded at all.
_DECIDES = 4


def classify(
    prepared: Prepared,
    run: DetectorRun,
    group: Sequence[Collision],
    force: ContactForce | None,
    config: Config,
    *,
    phases_known: bool,
) -> tuple[ContactKind, tuple[str, ...]]:
    """Weigh phase, rise time, frequency content and direction; each piece of evidence is one vote.

    A phase outside contact decides, for there no force is commanded at all; a direction across the commanded force, and
    a torque that the measured tool force leaves over, count twice. Where nothing states that a force was commanded, no
    contact is called meant: a slow, smooth torque is also what a clamp or an error of the model looks like.

    Returns:
        accidental or meant with a lead of two votes, else undecided; and the evidence in words.
    """
    series = prepared.judged_series
    main = max(group, key=lambda c: abs(c.peak_nm) / c.gamma_nm)
    j = series.column(main.joint)
    a, b = (int(k) for k in np.searchsorted(series.time_s, [main.onset_s, main.onset_s + main.duration_s]))
    votes: list[tuple[int, str]] = []
    phase = PHASES[int(prepared.phases[a])]
    if phases_known and phase == "contact":
        votes.append((-1, "it began in the contact phase, in which force is commanded"))
    elif phases_known:
        votes.append((_DECIDES, f"it began in the {phase} phase, in which no force is commanded"))
    if phases_known and phase == "contact":
        votes += _sensor_vote(prepared, a, b)
    votes += _shape_votes(run.residual.torque_nm[:, j], a, b, series.period_s)
    if phases_known and phase == "contact" and force is not None:
        votes += _direction_vote(prepared, force, a, config)
    if not phases_known:
        votes.append((0, "no phases are known, so that nothing says whether a force was commanded"))
    score = sum(v for v, _ in votes)
    kind: ContactKind = (
        "accidental" if score >= _SAFE_SCORE else "meant" if phases_known and score <= -_SAFE_SCORE else "undecided"
    )
    return kind, tuple(text for _, text in votes)


def _sensor_vote(prepared: Prepared, a: int, b: int) -> list[tuple[int, str]]:
    """What the wrist sensor saw was taken out of the residual: what is left did not come through the tool."""
    if prepared.contact_nm is None or not np.isfinite(prepared.contact_nm[a : b + 1]).all():
        return []
    first, last = (float(prepared.series.time_s[min(k, prepared.series.time_s.size - 1)]) for k in (a, b))
    if any(excess.start_s <= last and first <= excess.end_s for excess in prepared.commanded.excess):
        return [(2, "the tool met far more force than is usual or allowed in contact")]
    return [(2, "the force at the tool does not explain it: that was measured and taken out")]


def _shape_votes(residual: FloatArray, a: int, b: int, period_s: float) -> list[tuple[int, str]]:
    before = max(0, a - round(_BEFORE_RISE_S / period_s))
    part = np.abs(np.nan_to_num(residual[before : max(b, a + 2)]))
    peak = float(part.max())
    high = int(np.argmax(part >= 0.9 * peak))
    low = part[: high + 1] < 0.1 * peak
    rise = (high - int(np.flatnonzero(low)[-1]) if low.any() else high) * period_s
    votes = []
    if rise <= _FAST_RISE_S:
        votes.append((1, f"it rose from 10 to 90 % of its peak in {1e3 * rise:.0f} ms"))
    elif rise >= _SLOW_RISE_S:
        votes.append((-1, f"it took {1e3 * rise:.0f} ms to rise to 90 % of its peak"))
    margin = round(_SPECTRUM_MARGIN_S / period_s)
    share = _high_share(residual[max(0, a - margin) : b + margin], period_s)
    if share is not None:
        text = f"{100 * share:.0f} % of its variation lies above {_HIGH_HZ:g} Hz"
        votes.append((1 if share > _HIGH_SHARE else -1 if share < _LOW_SHARE else 0, text))
    return votes


def _high_share(x: FloatArray, period_s: float) -> float | None:
    """Share of the spectrum's power above 5 Hz, mean taken out."""
    x = x[np.isfinite(x)]
    if x.size < 16:
        return None
    power = np.abs(np.fft.rfft((x - x.mean()) * np.hanning(x.size))) ** 2
    high = np.fft.rfftfreq(x.size, period_s) > _HIGH_HZ
    total = float(power[1:].sum())
    return float(power[high].sum()) / total if total > 0 else None


def _direction_vote(prepared: Prepared, force: ContactForce, sample: int, config: Config) -> list[tuple[int, str]]:
    """Whether the external force runs along the commanded tool force, as it was measured."""
    frame, wrench = config.log.wrench_frame, prepared.series.wrench
    if (
        force.force_n is None
        or force.size_n is None
        or frame is None
        or wrench is None
        or not np.isfinite(wrench[sample]).all()
    ):
        return []
    rotation = prepared.robot.frame_rotation(prepared.series.position_rad[sample], frame)
    commanded = -config.log.wrench_sign * rotation @ wrench[sample, :3]
    size = float(np.linalg.norm(commanded)) * force.size_n
    if size == 0.0:
        return []
    cosine = float(commanded @ np.array(force.force_n)) / size
    if cosine > _ALIGNED:
        return [(-1, f"it acts along the commanded tool force (cosine {cosine:.2f})")]
    return [(2, f"it does not act along the commanded tool force (cosine {cosine:.2f})")]


#: Alarms of different joints closer than this are one contact.
_TOGETHER_S = 0.1
#: A force is told where the residuals are at least this share of their largest.
_NEARLY = 0.9


def find_contacts(prepared: Prepared, run: DetectorRun, config: Config) -> tuple[Contact, ...]:
    """Group the alarms of all joints into contacts and describe each.

    Args:
        prepared: the log and its model.
        run: what the detector made of it.
        config: phases and wrench settings.
    """
    groups = _groups(run.detected.collisions)
    if not groups:
        return ()
    peaks = [_peak_sample(prepared, run, group) for group in groups]
    known = Unsmoothed.of(prepared, run, peaks)
    at = ArmAtSamples(prepared, peaks, config.robot.tool.frame)
    return tuple(
        _describe(prepared, run, known, at, group, peak, config) for group, peak in zip(groups, peaks, strict=True)
    )


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
    prepared: Prepared,
    run: DetectorRun,
    known: Unsmoothed,
    at: ArmAtSamples,
    group: Sequence[Collision],
    peak: int,
    config: Config,
) -> Contact:
    series = prepared.judged_series
    names = [joint for joint in series.joint_names if any(c.joint == joint for c in group)]
    onset, end = min(c.onset_s for c in group), max(c.onset_s + c.duration_s for c in group)
    link, note, force, least = _locate(prepared, run, known, at, names, peak)
    kind, evidence = classify(prepared, run, group, force, config, phases_known=at.phases_known)
    if all(alarm.spoke == "cycle" for alarm in group):
        evidence = (*evidence, "Only the same place of other cycles tells it: by the model alone it stays below γ.")
    return Contact(
        onset_s=onset,
        detected_s=min(c.detected_s for c in group),
        end_s=end,
        joints=tuple(names),
        link=link,
        link_note=note,
        force=without_guess(force),
        kind=kind,
        evidence=evidence,
        least_force=least,
        scene=scene_at(prepared, peak, at.stick),
        peak_nm={name: max(abs(c.peak_nm) for c in group if c.joint == name) for name in names},
        after=after_contact(prepared, run, names, onset, end, at.stick[-1] if at.stick else None),
    )


def _locate(
    prepared: Prepared, run: DetectorRun, known: Unsmoothed, at: ArmAtSamples, names: Sequence[str], peak: int
) -> tuple[str, str, ContactForce | None, LeastForce | None]:
    """The link of a contact, what that does not exclude, the force at the peak's sample, the least that it can be.

    It is the link moved by the outermost of the joints that alarmed, base to tip.
    """
    series, robot = prepared.judged_series, prepared.robot
    outer = robot.joint_names.index(names[-1])
    beyond = [joint for joint in series.joint_names if robot.joint_names.index(joint) > outer]
    blind = [joint for joint in beyond if run.detected.state[peak, series.column(joint)] > State.JUDGED]
    link = at.links[outer] or f"the link moved by {names[-1]}"
    columns = [series.column(joint) for joint in names]
    sd = np.hypot(known.noise_nm[columns], 0.5 * run.residual.uncertainty_nm[peak, columns])
    least = least_force(at, names, known.torque_nm(peak)[columns], sd, peak)
    force = with_least(estimate_force(at, run, known, names, peak), least)
    if not beyond:
        return link, "The outermost judged joint reacted: the contact is at its link or further out.", force, least
    unjudged = f" (of these, {', '.join(blind)} could not be judged then)" if blind else ""
    note = (
        f"Not nearer the base than this. {', '.join(beyond)} did not react{unjudged}. A force that points through "
        "their axes turns none of them, so the contact may be further out."
    )
    return link, note, force, least


def _peak_sample(prepared: Prepared, run: DetectorRun, group: Sequence[Collision]) -> int:
    """Sample at which the joints' residuals, each over its threshold, are largest together.

    Of those at which they are nearly as large, one at which most joints are evidence: a joint within its friction
    interval shows only a part of its torque, and when it did not alarm nothing at all.
    """
    series = prepared.judged_series
    onset, end = min(c.onset_s for c in group), max(c.onset_s + c.duration_s for c in group)
    a, b = (int(k) for k in np.searchsorted(series.time_s, [onset, end]))
    part = slice(a, max(b, a + 1))
    ratio = np.stack([run.strongest(series.column(c.joint), part)[1] for c in group], axis=1)
    together = np.nan_to_num(np.abs(ratio)).sum(axis=1)
    near = together >= _NEARLY * together.max()
    judged = np.where(near, np.count_nonzero(run.detected.state[part] == State.JUDGED, axis=1), -1)
    return a + int(np.argmax(np.where(judged == judged.max(), together, -1.0)))


#: Steps closer than this are one disturbance; contacts this close are the same event, s.
_ONE_PUSH_S, _NEAR_CONTACT_S = 0.7, 0.5
_LISTED = 5


def rest_disturbances(
    steps: Sequence[RestDisturbance], names: Sequence[str], contacts: Sequence[tuple[float, float]]
) -> tuple[RestDisturbance, ...]:
    """Disturbances of standing joints that are no contact already, in order of time: steps that overlap are one.

    Args:
        steps: of single joints.
        names: of the joints, base to tip.
        contacts: start and end of those that were found, s.
    """
    apart = [
        step
        for step in steps
        if not any(
            step.onset_s < end + _NEAR_CONTACT_S and start - _NEAR_CONTACT_S < step.end_s for start, end in contacts
        )
    ]
    groups: list[list[RestDisturbance]] = []
    for step in sorted(apart, key=lambda step: (step.onset_s, names.index(step.joints[0].joint))):
        if groups and step.onset_s <= max(one.end_s for one in groups[-1]) + _ONE_PUSH_S:
            groups[-1].append(step)
        else:
            groups.append([step])
    found = []
    for group in groups:
        its = ([one.joints[0] for one in group if one.joints[0].joint == name] for name in names)
        largest = tuple(max(one, key=lambda joint: abs(joint.torque_step_nm)) for one in its if one)
        found.append(RestDisturbance(group[0].onset_s, max(one.end_s for one in group), largest))
    return tuple(found)


def disturbance_findings(found: Sequence[RestDisturbance], allowed: int) -> list[Finding]:
    """One finding on all of them; an error, with which no log passes, where there are more than are allowed.

    Args:
        found: of one log.
        allowed: how many a log may have.
    """
    if not found:
        return []
    steps = [", ".join(f"{j.joint} by {abs(j.torque_step_nm):.2g} N·m" for j in one.joints) for one in found[:_LISTED]]
    listed = "; ".join(f"{one.onset_s:.2f} s: {text}" for one, text in zip(found, steps, strict=False))
    more = f"; and {len(found) - _LISTED} more" if len(found) > _LISTED else ""
    once = "once" if len(found) == 1 else f"{len(found)} times"
    text = (
        f"Standing joints were pushed or released {once}, too weakly to alarm ({listed}{more}): the joint gave way and "
        "its drive pushed back. Friction hides how strong it was."
    )
    severity: Severity = "warning" if len(found) <= allowed else "error"
    return [Finding("disturbed-at-rest", severity, text, start_s=found[0].onset_s, end_s=found[-1].end_s)]
