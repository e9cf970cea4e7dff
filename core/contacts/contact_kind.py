"""Commanded (kind ``meant``), accidental or undecided: what speaks for each, and no verdict where little does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Collision
from collaudit.core.data.detection_result import ContactForce, ContactKind
from collaudit.core.detection.detector_run import DetectorRun
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
