"""The sign of the effort by friction: a drive that seems to gain power from friction has its effort inverted.

Gravity tells the sign of joints that carry load. Friction tells it of every joint that moves: it opposes the motion,
so the part of the effort that goes with the direction of motion is positive. Wrists have nothing else.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping

import numpy as np

from collaudit.core.data.uniform_series import MOVING_RAD_S, UniformSeries
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.filters import differentiate
from collaudit.core.numeric.parallel import by_name
from collaudit.core.prepare.effort.effort_gain import EffortGain, Slope, steady_slope

_MAX_SAMPLES = 50_000
#: Half width of the interval in standard errors: a sign is called inverted with 99.9 % confidence.
_SIGMAS = 3.3
#: Each direction has this share of the motion: else friction cannot be told from an offset.
_EACH_WAY = 0.1


def friction_signs(
    series: UniformSeries, model_torque: FloatArray, contact_nm: FloatArray | None = None
) -> dict[str, Slope]:
    """Mean torque along the motion by joint, in the effort's unit: positive where friction takes power.

    Least squares of effort = offset + gain·tau + late·dtau/dt + c·sgn(v) + d·v; the level is c + d·mean|v|, which is
    the coefficient of sgn(v) beside v - sgn(v)·mean|v|. The rate of the model torque takes up a delay of the effort,
    which would otherwise look like friction of either sign. As with gains, a third of the time tells no sign: a hand
    may lead the arm.

    Args:
        series: the log on its uniform time base.
        model_torque: (n, j) rigid-body torque, N·m.
        contact_nm: (n, j) torque of the commanded tool force, which adds to it where it is known.
    """
    if series.effort is None:
        return {}
    effort, velocity = series.effort, series.velocity_rad_s

    def one(joint: str) -> Slope | None:
        j = series.column(joint)
        known = model_torque[:, j]
        if contact_nm is not None:
            known = known + np.nan_to_num(contact_nm[:, j])
        rates = differentiate(known, series.segments, series.period_s)
        sliding = (np.abs(velocity[:, j]) > MOVING_RAD_S) & np.isfinite(effort[:, j] + known + rates)
        use = np.flatnonzero(sliding & ~series.edge)
        use = use[:: max(1, use.size // _MAX_SAMPLES)]
        v = velocity[use, j]
        way, ahead = np.sign(v), np.count_nonzero(v > 0)
        if min(ahead, v.size - ahead) <= _EACH_WAY * v.size:
            return None
        others = np.column_stack([np.ones_like(v), known[use], rates[use], v - way * float(np.mean(np.abs(v)))])
        return steady_slope(effort[use, j], way, others, np.floor(series.time_s[use]), _SIGMAS)

    return {joint: found for joint, found in by_name(one, series.joint_names).items() if found is not None}


def friction_sign_findings(
    signs: Mapping[str, Slope],
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
    for joint, sign in signs.items():
        gain = by_gravity.get(joint)
        if not sign.negative or joint not in judged or (gain is not None and gain.inverted):
            continue
        evidence = (
            f"The effort of joint '{joint}' goes with the motion instead of against friction: "
            f"{sign.value:.3g}{shown_unit} on average over its motion, without gravity (99.9 %: "
            f"{sign.value - sign.half:.3g} to {sign.value + sign.half:.3g})"
        )
        if gain is not None and gain.known:
            text = (
                f"{evidence}, while its gravity torque has the right sign: sign and mounting ([robot] base_rpy_deg) "
                "are both wrong, or delay, inertia or a person guiding the arm."
            )
            out.append(Finding("friction-gives-power", "warning", text, joint=joint))
        elif joint in stated:
            text = f"{evidence}. Its sign was taken as [log.units] effort_sign states it."
            out.append(Finding("effort-sign-inverted", "warning", text, joint=joint))
        else:
            text = (
                f"{evidence}. Friction takes power from the joint, so the sign of the effort looks inverted. If "
                "it is, state "
                f'[log.units]: effort_sign = {{ "{joint}" = -1 }}. Nothing was changed.'
            )
            out.append(Finding("effort-sign-inverted", "error", text, joint=joint))
    return out
