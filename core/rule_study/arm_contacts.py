"""Contacts added to a log at random places, directions and moments, and known ones: what a rule of the arm notices."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import ceil, sqrt

import numpy as np
from scipy.special import bdtrik as binomial_quantile

from collaudit.core.data.rule_study_result import ContactSensitivity, ForceNoticed, LabelledCurve, Motion
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectionInputs, DetectorRun
from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.recommend.arm_evidence import Times
from collaudit.core.rule_study.injected_contacts import (
    ContactShape,
    InjectedContact,
    open_moments,
    random_direction,
    spread_moments,
    unit_torques,
)
from collaudit.core.rule_study.joint_plane import excess, sustained_level
from collaudit.core.rule_study.shown_torque import (
    Windows,
    alarm_delays,
    margin_samples,
    noticed_forces,
    shown,
    through_filters,
    windows,
)
from collaudit.core.verdict.arm_places import Place, arm_places

#: Shares of contacts whose force is given.
NOTICED_SHARES = (0.5, 0.9)
#: The delay is that of contacts of so many times the force that each needs.
_DELAY_FORCES = 2.0
#: Fewer contacts than this say nothing of a place.
_FEWEST = 10
_SEED = 20210315


@dataclass(frozen=True, slots=True, eq=False)
class AddedContacts:
    """Contacts of one shape, added to one log.

    Attributes:
        shape: over time.
        contacts: k, with the place of each.
        standing: (k,) whether the joints that feel it stand at its onset.
        around: the watched joints there, (j, k, t).
        unit_nm: (j, k, t) torque of a newton through the filters.
        onset: sample of each window.
        period_s: sample period, s.
    """

    shape: ContactShape
    contacts: tuple[InjectedContact, ...]
    standing: BoolArray
    around: Windows
    unit_nm: FloatArray
    onset: int
    period_s: float

    def noticed(self, gamma_nm: FloatArray, n: int) -> tuple[FloatArray, float | None]:
        """(k,) force that each contact needs (:func:`noticed_forces`), and the median delay at twice that, s."""
        needed = noticed_forces(self.around, self.unit_nm, gamma_nm, n)
        twice = _DELAY_FORCES * np.where(np.isfinite(needed), needed, 0.0)
        late = alarm_delays(self.around, self.unit_nm, twice, gamma_nm, n, self.onset)
        return needed, float(np.median(late)) * self.period_s if late.size else None


def added_contacts(
    prepared: Prepared,
    run: DetectorRun,
    inputs: DetectionInputs,
    shape: ContactShape,
    free: BoolArray,
    most: int,
    tool: str | None,
) -> AddedContacts | None:
    """Contacts at evenly spread moments, each at a random place from a random direction.

    Args:
        prepared, run, inputs: the log, judged by a detector that tells joints apart.
        shape: of the contacts.
        free: (n,) samples without contact.
        most: number of contacts.
        tool: frame of the tool.

    Returns:
        None without a kinematic model, watched joints, or a stretch that is long enough.
    """
    series, kernel = prepared.judged_series, run.residual.balance.kernel
    columns = [series.column(joint) for joint in inputs.rule.watch]
    model_columns = prepared.columns()
    felt = [
        p
        for p in arm_places(prepared.robot, prepared.judged, tool)
        if any(model_columns[j] in p.columns for j in columns)
    ]
    margin = margin_samples(kernel, series.bandwidth_hz, series.period_s)
    after = ceil(shape.duration_s / series.period_s) + margin
    judged = np.asarray((run.detected.state[:, columns] <= State.FRICTION_INTERVAL).any(axis=1))
    moments = open_moments(series, free & np.isfinite(series.position_rad).all(axis=1), margin, after)
    moments = moments[judged[moments]]
    if not felt or moments.size == 0:
        return None
    rng = np.random.default_rng(_SEED)
    moments = spread_moments(moments, most, rng)
    contacts = tuple(_at_random(felt, int(sample), rng) for sample in moments)
    samples = moments[:, None] + np.arange(-margin, after)
    raw = unit_torques(prepared, contacts, samples, shape)[columns]
    unit = through_filters(raw, kernel, series.bandwidth_hz, series.period_s)
    around = windows(series, run, inputs.laws, columns, samples)
    gamma = np.array([inputs.rule.gamma_nm[joint] for joint in inputs.rule.watch])
    strongest = np.argmax(np.abs(raw).max(axis=2) / gamma[:, None], axis=0)
    standing = around.standing[strongest, np.arange(moments.size), margin]
    return AddedContacts(shape, contacts, standing, around, unit, margin, series.period_s)


def _at_random(felt: Sequence[Place], sample: int, rng: np.random.Generator) -> InjectedContact:
    place = felt[int(rng.integers(len(felt)))]
    phase = float(rng.random())
    return InjectedContact(sample, place.words, place.frame, random_direction(rng), felt=place.columns, phase=phase)


def contact_sensitivities(
    added: AddedContacts, gamma_nm: Mapping[str, float], joints: Sequence[str], n: int
) -> list[ContactSensitivity]:
    """What a rule notices of the contacts: of all, by motion, and by place.

    Args:
        added: to the watched joints.
        gamma_nm: thresholds.
        joints: names of the watched joints.
        n: persistence, samples.
    """
    gamma = np.array([gamma_nm[joint] for joint in joints])
    needed, delay_s = added.noticed(gamma, n)
    place = np.array([contact.place for contact in added.contacts])
    groups: list[tuple[str | None, Motion | None, BoolArray]] = [(None, None, np.ones(needed.size, dtype=np.bool_))]
    groups += [(None, "moving", ~added.standing), (None, "standing", added.standing)]
    groups += [(str(name), None, np.asarray(place == name)) for name in dict.fromkeys(place.tolist())]
    return [
        _summary(added.shape, name, motion, needed[mask & ~np.isnan(needed)], delay_s if name is None else None)
        for name, motion, mask in groups
        if np.count_nonzero(mask & ~np.isnan(needed)) >= _FEWEST
    ]


def _summary(
    shape: ContactShape, place: str | None, motion: Motion | None, needed: FloatArray, delay_s: float | None
) -> ContactSensitivity:
    ordered = np.sort(needed)
    return ContactSensitivity(
        shape=shape.name,
        duration_s=shape.duration_s,
        edge_s=shape.edge_s,
        place=place,
        motion=motion,
        contacts=int(needed.size),
        noticed=tuple(noticed_share(ordered, share) for share in NOTICED_SHARES),
        delay_s=delay_s,
        blind=float(np.mean(np.isinf(needed))),
    )


def noticed_share(ordered: FloatArray, share: float) -> ForceNoticed:
    """The force that a share of contacts needs at most, with the interval that their ranks give (binomial, 95 %).

    Args:
        ordered: (k,) force that each contact needs, rising; infinite where none does.
        share: of them.
    """
    count = ordered.size

    def at(rank: float) -> float | None:
        place = int(rank)
        value = ordered[place] if 0 <= place < count else np.inf
        return float(f"{value:.3g}") if np.isfinite(value) else None

    low, high = (float(binomial_quantile(p, count, share)) for p in (0.025, 0.975))
    lower = at(np.floor(low)) if low >= 0.0 else None
    return ForceNoticed(share, at(ceil(share * count - 1e-9) - 1), (lower, at(np.ceil(high))))


def wilson_interval(hits: int, count: int) -> tuple[float, float]:
    """95 % interval of a share (Wilson 1927), which is sound at 0 and 1 too."""
    z, share = NORMAL_QUANTILE_975, hits / count
    middle = share + z * z / (2 * count)
    half = z * sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    return max(0.0, (middle - half) / (1 + z * z / count)), min(1.0, (middle + half) / (1 + z * z / count))


#: Factors on the thresholds, and forces of the added contacts, N.
_SCALES = np.geomspace(0.25, 16.0, 25)
_FORCES_N = (5.0, 10.0, 20.0, 40.0)
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
    series, n = prepared.judged_series, inputs.rule.n
    columns = [series.column(joint) for joint in inputs.rule.watch]
    gamma = np.array([inputs.rule.gamma_nm[joint] for joint in inputs.rule.watch])
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
        injected={} if added is None else {f"{force:g}": _missed(added, force, gamma, n) for force in _FORCES_N},
    )


def _missed(added: AddedContacts, force_n: float, gamma: FloatArray, n: int) -> tuple[float, ...]:
    """Share of the added contacts that a force leaves unnoticed, at each factor."""
    level = sustained_level(shown(added.around, force_n * added.unit_nm), np.array([n]))[..., 0]
    reached = (level / gamma[:, None]).max(axis=0)
    return tuple(float(np.mean(reached <= scale)) for scale in _SCALES)
