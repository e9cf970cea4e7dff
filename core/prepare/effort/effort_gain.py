"""Does the effort behave like a joint torque? Its gain and sign against the model's torque."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np

from collaudit.core.data.uniform_series import LEAST_EFFORT_CHANGE, MOVING_RAD_S, UniformSeries
from collaudit.core.numeric.arrays import FloatArray, IntArray
from collaudit.core.numeric.parallel import ordered_map
from collaudit.core.numeric.stats import STANDARD_ERRORS_95
from collaudit.core.prepare.effort.channel_shift import basis_of
from collaudit.core.robot.robot_model import RobotModel

_MIN_CLUSTERS = 8
_MAX_SAMPLES = 50_000
_MIN_EXPLAINED = 0.2
#: A joint that keeps to less is an arm that gives under a touch; its effort against the model tells of the touch.
_LEAST_TRAVEL_RAD = 0.05
#: Torque by a motor's current is good to about a tenth (its constant, warm magnets), by a sensor behind it to less.
ACCURATE_GAIN = (0.9, 1.1)
#: Beyond this it is of another unit than N·m.
PLAUSIBLE_GAIN = (0.5, 2.0)
#: An effort that shows less of the model's torque shows none of it: springs that carry an arm leave more to its drives
#: (0.2 and more of gravity, on arms with a counterbalance), and no description is wrong by so much.
LEAST_SHARE = 0.1
#: Share of its standard deviation that a column must have of its own, beside the others. Torque by a description is
#: good to about a fifth (masses, centres of mass): what others leave of it is that error, where they leave no more.
_LEAST_OWN = 0.2
#: The columns of a tool are looked at on so many samples: its regressor is one of all bodies.
_MOST_WITH_TOOL = 8000
#: Share of the seconds that a sign must not rest on, and in how many rounds they are left out.
_LEFT_OUT, _ROUNDS = 0.33, 4

Seconds = FloatArray | IntArray


@dataclass(frozen=True, slots=True)
class Slope:
    """How a channel goes with one column, others beside it.

    Attributes:
        value: coefficient of the column.
        half: half width of its interval, from the scatter between stretches of one second.
        explained: share of the channel's variance, after the others, that the column explains.
    """

    value: float
    half: float
    explained: float

    @property
    def negative(self) -> bool:
        """Whether the channel clearly runs against the column."""
        return self.value + self.half < 0 and self.explained >= _MIN_EXPLAINED

    @property
    def positive(self) -> bool:
        """Whether the channel clearly goes with the column."""
        return self.value - self.half > 0 and self.explained >= _MIN_EXPLAINED


@dataclass(frozen=True, slots=True)
class EffortGain:
    """Effort regressed on the model's torque, with friction and offset beside it.

    Attributes:
        joint: joint name.
        gain: effort per N·m of model torque; 1 for a torque in N·m, negative when inverted.
        ci95: interval, from the scatter between stretches of one second.
        explained: share of the effort's variance, after friction and offset, that the model torque explains.
        model_nm: standard deviation of the model torque in the motion looked at, N·m.
    """

    joint: str
    gain: float
    ci95: tuple[float, float]
    explained: float
    model_nm: float = 0.0

    @property
    def inverted(self) -> bool:
        """Whether the effort clearly runs against the model's torque."""
        return self.ci95[1] < 0 and self.explained >= _MIN_EXPLAINED

    @property
    def known(self) -> bool:
        """Whether the motion loaded the joint enough to tell the sign."""
        return (self.ci95[0] > 0 or self.ci95[1] < 0) and self.explained >= _MIN_EXPLAINED

    def lacks_model(self, least_share: float = LEAST_SHARE) -> bool:
        """Whether the effort surely shows less than this share of the model's torque, of either sign."""
        return max(-self.ci95[0], self.ci95[1]) < least_share

    def exceeds_arm(self, largest_nm: float) -> bool:
        """Whether what it has beyond the model's torque surely outweighs that of the arm's most loaded joint, N·m."""
        return self.known and self.ci95[0] > PLAUSIBLE_GAIN[1] and (self.ci95[0] - 1.0) * self.model_nm > largest_nm

    @property
    def off(self) -> bool:
        """Whether it has the right sign, and clearly another size than the accuracy of a measured torque explains."""
        return self.known and self.ci95[0] > 0 and not overlaps(self.ci95, ACCURATE_GAIN)


def effort_gains(
    series: UniformSeries,
    model_torque: FloatArray,
    contact_nm: FloatArray | None = None,
    nuisance: FloatArray | None = None,
) -> tuple[EffortGain, ...]:
    """Least squares of effort = gain·tau_model + c·sgn(v) + d·v + offset per joint, over moving samples.

    Args:
        series: the log on its uniform time base.
        model_torque: (n, j) rigid-body torque, N·m.
        contact_nm: (n, j) torque of the commanded tool force, which adds to it where it is known.
        nuisance: (n, j, k) columns that may explain the effort besides: what the model may lack.

    Returns:
        One entry for each joint with enough motion.
    """
    if series.effort is None:
        return ()
    effort, velocity, names = series.effort, series.velocity_rad_s, series.joint_names

    def one(j: int) -> EffortGain | None:
        use = _samples(effort[:, j], model_torque[:, j], velocity[:, j])
        if use.size == 0 or float(np.ptp(series.position_rad[use, j])) < _LEAST_TRAVEL_RAD:
            return None
        if float(np.ptp(effort[use, j])) <= LEAST_EFFORT_CHANGE:
            return None
        model = model_torque[use, j]
        if contact_nm is not None:
            model = model + np.nan_to_num(contact_nm[use, j])
        others = sliding_columns(velocity[use, j], () if nuisance is None else nuisance[use, j].T)
        found = steady_slope(effort[use, j], model, others, np.floor(series.time_s[use]))
        if found is None:
            return None
        ends = found.value - found.half, found.value + found.half
        return EffortGain(names[j], found.value, ends, found.explained, float(np.std(model)))

    return tuple(gain for gain in ordered_map(one, range(len(names))) if gain is not None)


def _samples(effort: FloatArray, model: FloatArray, velocity: FloatArray) -> IntArray:
    """At most twice :data:`_MAX_SAMPLES` at which the joint moves and all is known, spread over the log.

    Of a long log every so many-th is looked at first, and all only when that finds too few.
    """
    found: IntArray = np.empty(0, dtype=np.int64)
    for step in sorted({max(1, effort.size // (4 * _MAX_SAMPLES)), 1}, reverse=True):
        x, tau, v = effort[::step], model[::step], velocity[::step]
        found = step * np.flatnonzero(np.isfinite(x) & np.isfinite(tau) & (np.abs(v) > MOVING_RAD_S))
        if found.size >= _MAX_SAMPLES:
            break
    return found[:: max(1, found.size // _MAX_SAMPLES)]


def sliding_columns(v: FloatArray, more: Sequence[FloatArray] = ()) -> FloatArray:
    """(n, k) columns of sliding friction at (n,) speeds, an offset, and what else may explain the effort."""
    return np.column_stack([np.sign(v), v, np.ones_like(v), *more])


def slope_beside(
    y: FloatArray, x: FloatArray, others: FloatArray, second: Seconds, sigmas: float = STANDARD_ERRORS_95
) -> Slope | None:
    """Least squares of a channel on one column beside others; None where too little tells it, or too little is its own.

    The interval is cluster-robust (one-second clusters; Liang and Zeger, Biometrika 73, 1986), since
    residuals of neighbouring samples are alike.

    Args:
        y, x: (n,) channel and column.
        others: (n, k); columns alike count once.
        second: (n,) number of the second that each sample is of.
        sigmas: half width of the interval in standard errors.
    """
    seconds, label = np.unique(second, return_inverse=True)
    if y.size < 2 * _MIN_CLUSTERS or seconds.size < _MIN_CLUSTERS:
        return None
    x_free, y_free = _free(y, x, others)
    power = float(x_free @ x_free)
    if power <= max(1e-9, _LEAST_OWN**2 * float(np.var(x))) * x.size:
        return None
    value = float(x_free @ y_free) / power
    score = np.bincount(label, weights=x_free * (y_free - value * x_free))
    small_sample = seconds.size / (seconds.size - 1)
    error = float(np.sqrt(small_sample * np.sum(score**2))) / power
    spread = float(y_free @ y_free)
    explained = value**2 * power / spread if spread > 0 else 0.0
    return Slope(value, sigmas * (1.0 + 2.0 / seconds.size) * error, min(1.0, explained))


def steady_slope(
    y: FloatArray, x: FloatArray, others: FloatArray, second: Seconds, sigmas: float = STANDARD_ERRORS_95
) -> Slope | None:
    """The slope, unless a third of the time is all that speaks for a negative one, as a contact in the log can.

    An inverted sign is inverted all the time. The seconds that speak for it most are left out, what stands beside it
    estimated anew each time; where the others then say the opposite, theirs is the slope. Arguments as of
    :func:`slope_beside`.
    """
    found = slope_beside(y, x, others, second, sigmas)
    if found is None or not found.negative:
        return found
    for _ in range(_ROUNDS):
        _, label = np.unique(second, return_inverse=True)
        x_free, y_free = _free(y, x, others)
        speaks = np.bincount(label, weights=x_free * y_free)
        keep = ~np.isin(label, np.argsort(speaks)[: max(1, int(_LEFT_OUT / _ROUNDS * speaks.size))])
        y, x, others, second = y[keep], x[keep], others[keep], second[keep]
        rest = slope_beside(y, x, others, second, sigmas)
        if rest is None:
            return found
        if rest.value > 0.0:
            return rest
    return found


def _free(y: FloatArray, x: FloatArray, others: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Column x and channel y (n,) less what columns (n, k) explain of them; columns alike count once."""
    basis = basis_of(others)
    return x - basis @ (basis.T @ x), y - basis @ (basis.T @ y)


def described_gains(
    series: UniformSeries,
    robot: RobotModel,
    contact_nm: FloatArray | None,
    load_nm: FloatArray | None,
    lacking: Collection[str],
    tool_frame: str | None,
) -> tuple[EffortGain, ...]:
    """:func:`effort_gains` against the arm as it is described, for a log that is judged with identified inertials.

    Those take up whatever scale the fitted log had, so against them the effort of a log that is scaled alike fits. What
    the fit found the description to lack stands beside it as free columns: rotor inertia, and what a tool adds.

    Args:
        series: the log.
        robot: as described, with inertials.
        contact_nm: (n, j) torque of the commanded tool force.
        load_nm: (n, j) torque of a known load.
        lacking: what was identified.
        tool_frame: frame of the tool; None for the last one.
    """
    with_tool = "tool" in lacking
    most = _MOST_WITH_TOOL if with_tool else _MAX_SAMPLES
    rows = slice(None, None, max(1, series.time_s.size // most))
    q, v = series.position_rad[rows], series.velocity_rad_s[rows]
    a = np.asarray(series.acceleration_rad_s2[rows])
    part = replace(
        series,
        time_s=series.time_s[rows],
        position_rad=q,
        velocity_rad_s=v,
        effort=None if series.effort is None else series.effort[rows],
    )
    rigid = robot.inverse_dynamics(q, v, a)
    if load_nm is not None:
        rigid = rigid + load_nm[rows]
    columns = [a[:, :, None]] if "rotor" in lacking else []
    if with_tool:
        body = robot.in_joint(tool_frame)[2]
        motion = (np.nan_to_num(x) for x in (q, v, a))
        columns.append(robot.torque_regressor(*motion)[:, :, 10 * body : 10 * body + 4])
    nuisance = np.concatenate(columns, axis=2) if columns else None
    return effort_gains(part, rigid, None if contact_nm is None else contact_nm[rows], nuisance)


def overlaps(a: tuple[float, float], b: tuple[float, float]) -> bool:
    """Whether two intervals have a value in common."""
    return a[0] <= b[1] and b[0] <= a[1]
