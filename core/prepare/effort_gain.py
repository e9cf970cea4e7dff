"""Does the effort behave like a joint torque? Its gain, scale and sign against the model's; its sign by friction.

Gravity tells the sign of joints that carry load. Friction tells it of every joint that moves: it opposes the motion,
so the part of the effort that goes with the direction of motion is positive. Wrists have nothing else.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

import numpy as np

from collaudit.core.data.identification_result import Identified
from collaudit.core.findings import Finding
from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.block_sums import LEAST_OWN, MIN_EXPLAINED, Slope
from collaudit.core.torque_table.log_samples import SLIDING, TorqueTable

#: Torque by a motor's current is good to about a tenth (its constant, warm magnets), by a sensor behind it to less.
ACCURATE_GAIN = (0.9, 1.1)
#: Beyond this it is of another unit than N·m.
PLAUSIBLE_GAIN = (0.5, 2.0)
#: An effort that shows less of the model's torque shows none of it: springs that carry an arm leave more to its drives
#: (0.2 and more of gravity, on arms with a counterbalance), and no description is wrong by so much.
LEAST_SHARE = 0.1
#: The columns of a tool are looked at on so many samples: its regressor is one of all bodies.
_MOST_WITH_TOOL = 8000
#: Half width of the interval in standard errors: a sign is called inverted with 99.9 % confidence.
_SIGMAS = 3.3
#: Each direction has this share of the motion: else friction cannot be told from an offset.
_EACH_WAY = 0.1
#: The lines that tell an effort's scale.
_STATE = (
    'State what it is in [log.units]: effort = "A" or "mA" with torque_constant_nm_per_a, "percent" or "permille" with '
    'rated_torque_nm; or, of any unit, "raw", and a fit of motion without contact finds its scale.'
)
_SEVERAL = 2  # joints out of scale speak of the log's unit, one of its inertials


@dataclass(frozen=True, slots=True)
class EffortGain:
    """Effort regressed on the model's torque, with friction and offset beside it.

    Attributes:
        joint: joint name.
        gain: effort per N·m of model torque; 1 for a torque in N·m, negative when inverted.
        ci95: interval, from the scatter between blocks of time.
        explained: share of the effort's variance, after friction and offset, that the model torque explains.
        model_nm: standard deviation of the model torque in the motion looked at, N·m.
        effort_sd: that of the effort, in its unit.
    """

    joint: str
    gain: float
    ci95: tuple[float, float]
    explained: float
    model_nm: float = 0.0
    effort_sd: float = 0.0

    @property
    def inverted(self) -> bool:
        """Whether the effort clearly runs against the model's torque."""
        return self.ci95[1] < 0 and self.explained >= MIN_EXPLAINED

    @property
    def known(self) -> bool:
        """Whether the motion loaded the joint enough to tell the sign."""
        return (self.ci95[0] > 0 or self.ci95[1] < 0) and self.explained >= MIN_EXPLAINED

    @property
    def said(self) -> str:
        """The gain with its interval, in words."""
        return f"{self.gain:.3g} per N·m of model torque (95 %: {self.ci95[0]:.3g} to {self.ci95[1]:.3g})"

    @property
    def lacks_model(self) -> bool:
        """Whether the effort surely shows none of the model's torque, of either sign.

        Of a torque that is small beside the effort nothing is sure: the shape of friction hides it, and the noise of a
        wrench that is part of it lowers the gain.
        """
        told = self.model_nm >= LEAST_OWN * self.effort_sd
        return told and max(-self.ci95[0], self.ci95[1]) < LEAST_SHARE

    def exceeds_arm(self, largest_nm: float) -> bool:
        """Whether what it has beyond the model's torque surely outweighs that of the arm's most loaded joint, N·m."""
        return self.known and self.ci95[0] > PLAUSIBLE_GAIN[1] and (self.ci95[0] - 1.0) * self.model_nm > largest_nm

    @property
    def off(self) -> bool:
        """Whether it has the right sign, and clearly another size than the accuracy of a measured torque explains."""
        return self.known and self.ci95[0] > 0 and not overlaps(self.ci95, ACCURATE_GAIN)


def effort_gains(table: TorqueTable, nuisance: FloatArray | None = None) -> tuple[EffortGain, ...]:
    """Least squares of effort = gain·tau_model + c·sgn(v) + d·v + offset per joint, over moving samples.

    Args:
        table: the log, with its model torque.
        nuisance: (m, j, k) columns that may explain the effort besides: what the model may lack.

    Returns:
        One entry for each joint with enough motion.
    """
    columns = {} if nuisance is None else {f"lacking{k}": nuisance[:, :, k] for k in range(nuisance.shape[2])}
    gains = []
    for joint, sums in table.sums(**columns).items():
        found = sums.slope("effort", "model", *SLIDING, *columns)
        if found is not None:
            ends = found.value - found.half, found.value + found.half
            sizes = sums.sd("model"), sums.sd("effort")
            gains.append(EffortGain(joint, found.value, ends, found.explained, *sizes))
    return tuple(gains)


def described_gains(
    table: TorqueTable, robot: RobotModel, lacking: Collection[str], tool_frame: str | None
) -> tuple[EffortGain, ...]:
    """:func:`effort_gains` against the arm as it is described, for a log that is judged with identified inertials.

    Those take up whatever scale the fitted log had, so against them the effort of a log that is scaled alike fits. What
    the fit found the description to lack stands beside it as free columns: rotor inertia, and what a tool adds.

    Args:
        table: the log, its model torque that of the description.
        robot: as described, with inertials.
        lacking: what was identified.
        tool_frame: frame of the tool; None for the last one.
    """
    columns = [table.motion[2][:, :, None]] if "rotor" in lacking else []
    if "tool" in lacking:
        rows, body = slice(None, None, max(1, len(table.time_s) // _MOST_WITH_TOOL)), 10 * robot.in_joint(tool_frame)[2]
        columns.append(np.full((*table.effort.shape, 4), np.nan))
        some = robot.torque_regressor(*(np.nan_to_num(x[rows]) for x in table.motion))
        columns[-1][rows] = some[:, :, body : body + 4]
    return effort_gains(table, np.concatenate(columns, axis=2) if columns else None)


def overlaps(a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether two intervals have a value in common."""
    return a[0] <= b[1] and b[0] <= a[1]


def friction_signs(table: TorqueTable) -> dict[str, Slope]:
    """Mean torque along the motion by joint, in the effort's unit: positive where friction takes power.

    Least squares of effort = offset + gain·tau + late·dtau/dt + c·sgn(v) + d·v; the level is c + d·mean|v|, which is
    the coefficient of sgn(v) beside v - sgn(v)·mean|v|. The rate of the model torque takes up a delay of the effort,
    which would otherwise look like friction of either sign.
    """
    both_ways = {joint: one for joint, one in table.sums().items() if abs(one.mean("way")) < 1.0 - 2.0 * _EACH_WAY}
    slopes = {
        joint: one.slope("effort", "way", "beyond", "one", "model", "rate", sigmas=_SIGMAS)
        for joint, one in both_ways.items()
    }
    return {joint: slope for joint, slope in slopes.items() if slope is not None}


def scale_findings(
    gains: Sequence[EffortGain], unit: str, loaded: Callable[[], Sequence[EffortGain]] = tuple
) -> list[Finding]:
    """Joints whose effort is not in the scale of the described model, and a log that is not. Nothing is changed by it.

    Args:
        gains: against the arm as described, by joint.
        unit: of the effort.
        loaded: the same with a load left open, which outweighs the wrists of a small arm: with the others in scale
            nothing speaks against the unit.
    """
    if unit != "Nm":
        return []
    if (scale := _other_scale(gains)) is not None:
        known = [gain for gain in loaded() if gain.known]
        if not known or any(not overlaps(gain.ci95, ACCURATE_GAIN) for gain in known):
            return [scale]
    findings = []
    largest_nm = max((gain.model_nm for gain in gains), default=0.0)
    for gain in gains:
        if gain.lacks_model or gain.exceeds_arm(largest_nm):
            what = "shows none of that torque" if gain.lacks_model else "would take a load that outweighs the whole arm"
            text = (
                f"The effort of joint '{gain.joint}' is {gain.said}: it {what}, so it is no torque in N·m, or the "
                f"masses on file are wrong. Nothing is judged by it. {_STATE}"
            )
            findings.append(Finding("effort-gain", "error", text, joint=gain.joint))
        elif gain.off:
            text = (
                f"The effort of joint '{gain.joint}' is {gain.said}: contact torques appear {gain.gain:.2g} times "
                "as large there, or the masses on file are wrong (a payload that they lack?)."
            )
            findings.append(Finding("effort-gain", "warning", text, joint=gain.joint))
    return findings


def identified_scale_findings(identified: Identified | None, joints: Collection[str], unit: str) -> list[Finding]:
    """Joints whose identified gain is none of a torque in N·m although the log's unit, or its constant, says so.

    Args:
        identified: of the friction file.
        joints: to speak of.
        unit: of the effort as logged, its constants applied.
    """
    if identified is None or "gain" not in identified.estimate or unit != "Nm":
        return []
    findings = []
    for joint, found in identified.joints.items():
        low, high = found.gain_ci95 or (None, None)
        interval = -np.inf if low is None else low, np.inf if high is None else high
        if joint not in joints or found.gain is None or overlaps(interval, ACCURATE_GAIN):
            continue
        text = (
            f"The effort of joint '{joint}' was found to be {found.gain:.3g} per N·m (95 %: {interval[0]:.3g} to "
            f"{interval[1]:.3g}), against its stated unit or constant. Its torque was taken with what was found."
        )
        findings.append(Finding("effort-gain", "warning", text, joint=joint))
    return findings


def _other_scale(gains: Sequence[EffortGain]) -> Finding | None:
    """That the log is in another unit than N·m: several joints out of scale, and most of those that tell at all."""
    known = [gain for gain in gains if gain.known or gain.lacks_model]
    far = [gain for gain in known if gain.lacks_model or _elsewhere(gain)]
    if len(far) < _SEVERAL or 2 * len(far) <= len(known):
        return None
    each = ", ".join(f"{g.joint} {g.gain:.3g} [{g.ci95[0]:.3g} to {g.ci95[1]:.3g}]" for g in far)
    text = (
        f"The efforts of {len(far)} of the {len(known)} joints that the model's torque loads are not in its scale, per "
        f"N·m of it (95 %): {each}. They are no torques in N·m, or the model is that of another arm, mounting or "
        f"unit of mass: nothing is judged by them. {_STATE}"
    )
    return Finding("effort-no-torque", "error", text)


def _elsewhere(gain: EffortGain) -> bool:
    """Whether it has the right sign, and surely another scale than a torque by any description."""
    low, high = gain.ci95
    return gain.gain > 0 and not overlaps(gain.ci95, PLAUSIBLE_GAIN) and high - low < gain.gain
