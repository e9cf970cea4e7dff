"""The sign of the effort by friction: a drive that seems to gain power from friction has its effort inverted.

Gravity tells the sign of joints that carry load. Friction tells it of every joint that moves: it opposes the motion,
so the part of the effort that goes with the direction of motion is positive. Wrists have nothing else.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.filters import differentiate
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.prepare.effort.effort_gain import EffortGain

_CLUSTER_S = 1.0
_MIN_CLUSTERS = 8
_MAX_SAMPLES = 50_000
_MIN_EXPLAINED = 0.2
#: Half width of the interval in standard errors: a sign is called inverted with 99.9 % confidence.
_SIGMAS = 3.3
#: Share of the seconds that the sign must not rest on, as a hand that leads the arm takes.
_LEFT_OUT = 0.33
_DIRECTION = 3  # first of the two columns of friction


@dataclass(frozen=True, slots=True)
class FrictionSign:
    """Mean torque of one joint along its motion, gravity and an offset taken out.

    Attributes:
        joint: its name.
        level: mean over moving time, in the effort's unit; positive where friction takes power.
        half: half width of its 99.9 % interval, from the scatter between seconds.
        explained: share of the effort's variance, after model torque and offset, that friction explains.
        both_ways: whether each direction has its share of the motion.
    """

    joint: str
    level: float
    half: float
    explained: float
    both_ways: bool

    @property
    def negative(self) -> bool:
        """Whether friction clearly gives power."""
        return self.both_ways and self.level + self.half < 0 and self.explained >= _MIN_EXPLAINED

    @property
    def positive(self) -> bool:
        """Whether friction clearly takes power."""
        return self.both_ways and self.level - self.half > 0 and self.explained >= _MIN_EXPLAINED


def friction_signs(
    series: UniformSeries, model_torque: FloatArray, contact_nm: FloatArray | None = None
) -> tuple[FrictionSign, ...]:
    """Least squares of effort = offset + gain·tau + late·dtau/dt + c·sgn(v) + d·v; the level is c + d·mean|v|.

    The rate of the model torque takes up a delay of the effort, which would otherwise look like friction of either
    sign. Intervals are cluster-robust over seconds, as those of the gains are.

    Args:
        series: the log on its uniform time base.
        model_torque: (n, j) rigid-body torque, N·m.
        contact_nm: (n, j) torque of the commanded tool force, which adds to it where it is known.
    """
    if series.effort is None:
        return ()
    effort, velocity = series.effort, series.velocity_rad_s

    def one(j: int) -> FrictionSign | None:
        known = model_torque[:, j]
        if contact_nm is not None:
            known = known + np.nan_to_num(contact_nm[:, j])
        rates = differentiate(known, series.segments, series.period_s)
        sliding = (np.abs(velocity[:, j]) > MOVING_RAD_S) & np.isfinite(effort[:, j] + known + rates)
        use = np.flatnonzero(sliding & ~series.edge)
        use = use[:: max(1, use.size // _MAX_SAMPLES)]
        second = np.floor(series.time_s[use] / _CLUSTER_S).astype(np.int64)
        v = velocity[use, j]
        columns = np.column_stack([np.ones_like(v), known[use], rates[use], np.sign(v), v])
        return _sign(series.joint_names[j], columns, effort[use, j], second)

    return tuple(found for found in ordered_map(one, range(len(series.joint_names))) if found is not None)


def _sign(joint: str, columns: FloatArray, effort: FloatArray, second: IntArray) -> FrictionSign | None:
    """The level, with the third of the seconds left out that speaks most for a negative one."""
    ids, label = np.unique(second, return_inverse=True)
    if ids.size < _MIN_CLUSTERS:
        return None
    found = _level(joint, columns, effort, label)
    if not found.negative:
        return found
    rest = columns[:, :_DIRECTION]
    left = effort - rest @ np.linalg.lstsq(rest, effort, rcond=None)[0]
    speaks = np.bincount(label, weights=columns[:, _DIRECTION] * left)
    worst = np.argsort(speaks)[: int(_LEFT_OUT * ids.size)]
    keep = ~np.isin(label, worst)
    _, again = np.unique(label[keep], return_inverse=True)
    other = _level(joint, columns[keep], effort[keep], again)
    return found if other.level < 0 else other


def _level(joint: str, columns: FloatArray, effort: FloatArray, label: IntArray) -> FrictionSign:
    scale = np.maximum(np.linalg.norm(columns, axis=0), 1e-12)
    scaled = columns / scale
    inverse = np.linalg.pinv(scaled.T @ scaled, rcond=1e-9, hermitian=True)
    estimate = inverse @ (scaled.T @ effort)
    rest = effort - scaled @ estimate
    scores = np.stack([np.bincount(label, weights=scaled[:, k] * rest) for k in range(scaled.shape[1])], axis=1)
    count = scores.shape[0]
    covariance = count / max(1, count - 1) * inverse @ (scores.T @ scores) @ inverse
    speed = float(np.mean(np.abs(columns[:, _DIRECTION + 1])))
    mean = np.zeros(scaled.shape[1])
    mean[_DIRECTION], mean[_DIRECTION + 1] = 1.0 / scale[_DIRECTION], speed / scale[_DIRECTION + 1]
    others = scaled[:, :_DIRECTION]
    plain = effort - others @ np.linalg.lstsq(others, effort, rcond=None)[0]
    power = float(plain @ plain)
    explained = 1.0 - float(rest @ rest) / power if power > 0 else 0.0
    ahead = float(np.mean(columns[:, _DIRECTION] > 0))
    half = _SIGMAS * float(np.sqrt(max(0.0, mean @ covariance @ mean)))
    return FrictionSign(joint, float(mean @ estimate), half, explained, 0.1 <= ahead <= 0.9)


def friction_sign_findings(
    signs: tuple[FrictionSign, ...],
    gains: tuple[EffortGain, ...],
    judged: Collection[str],
    stated: Collection[str],
    unit: str,
) -> list[Finding]:
    """Joints whose friction gives power: the effort is inverted where gravity does not say otherwise.

    Args:
        signs: by joint.
        gains: the sign by gravity; where it is inverted too, that has been said.
        judged: joints to speak of.
        stated: joints whose sign the configuration states: that holds, and what speaks against it is a warning.
        unit: of the effort.
    """
    by_gravity = {g.joint: g for g in gains}
    shown_unit = " N·m" if unit == "Nm" else ""
    out = []
    for sign in signs:
        gain = by_gravity.get(sign.joint)
        if not sign.negative or sign.joint not in judged or (gain is not None and gain.inverted):
            continue
        evidence = (
            f"The effort of joint '{sign.joint}' goes with the motion instead of against friction: "
            f"{sign.level:.3g}{shown_unit} on average over its motion, without gravity (99.9 %: "
            f"{sign.level - sign.half:.3g} to {sign.level + sign.half:.3g})"
        )
        if gain is not None and gain.known:
            text = (
                f"{evidence}, while its gravity torque has the right sign: sign and mounting ([robot] base_rpy_deg) "
                "are both wrong, or delay, inertia or a person guiding the arm."
            )
            out.append(Finding("friction-gives-power", "warning", text, joint=sign.joint))
        elif sign.joint in stated:
            text = f"{evidence}. Its sign was taken as [log.units] effort_sign states it."
            out.append(Finding("effort-sign-inverted", "warning", text, joint=sign.joint))
        else:
            text = (
                f"{evidence}. Friction takes power from the joint, so the sign of the effort looks inverted. If "
                "it is, state "
                f'[log.units]: effort_sign = {{ "{sign.joint}" = -1 }}. Nothing was changed.'
            )
            out.append(Finding("effort-sign-inverted", "error", text, joint=sign.joint))
    return out
