"""Everything about one log that fitting and judging share: conditioned signals, model torque, checks."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.data import Showing, Shown, first_few
from collaudit.core.data.joint_log import JointLog, UniformSeries
from collaudit.core.findings import Finding, torque_unit_of
from collaudit.core.numeric.arrays import FloatArray, Span
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.channel_delay import Delay
from collaudit.core.prepare.commanded_force import CommandedTorque
from collaudit.core.prepare.effort_gain import EffortGain
from collaudit.core.prepare.effort_kind import EffortKind, EffortSource
from collaudit.core.prepare.effort_smoothing import Smoothing
from collaudit.core.prepare.model_bandwidth import ModelBandwidth
from collaudit.core.robot.robot_model import RobotModel
from collaudit.core.torque_table.log_samples import TorqueTable


@dataclass(frozen=True, slots=True, eq=False)
class ConditionedLog:
    """One log before its model torque: what every calibration of it starts from.

    Attributes:
        series: all joints that the log and the model share, in model order; the effort as logged.
        robot: the model as described; without gravity where the effort holds none.
        judged: names of the joints to judge.
        phases: (n,) phase labels (``core/prepare/phases.py``).
        findings: of the log, the description, positions and phases.
        effort_kind: on which side of the gears the effort is measured, and whether gravity is in it.
        load_nm: (n, j) torque of a known load that this log's arm carries beyond the model; None for none.
        table: the log thinned, its effort as logged and no model torque; None without an effort.
    """

    series: UniformSeries
    robot: RobotModel
    judged: tuple[str, ...]
    phases: NDArray[np.int8]
    findings: tuple[Finding, ...]
    effort_kind: EffortKind = field(default_factory=EffortKind)
    load_nm: FloatArray | None = None
    table: TorqueTable | None = None


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Prepared(Showing):
    """One log, ready to be fitted or judged.

    Attributes:
        series: all joints that the log and the model share, in model order; the effort as calibrated.
        robot: the model, as calibrated.
        rigid_nm: (n, j) rigid-body torque, or None without inertials.
        commanded: torque of the commanded tool force.
        judged: names of the joints to judge.
        phases: (n,) phase labels (``core/prepare/phases.py``).
        gains: effort against model torque, by joint.
        sign_delay: delay of the effort that explains signs which seem inverted; None where none does.
        findings: of the log, the model and the checks.
        calibration: what was known of the arm besides its description.
        start: the log before its model torque.
        quiet: joints whose model torque is used without the bands that are noise.
        scale: those of the findings that are on the size of the effort against the model, or on its masses.
        effort_smoothing: by joint how far the effort is smoothed over time; empty where no motion tells.
        upright: joints whose friction clearly takes power with their effort's sign as it is.
        judged_series: the series with the judged joints only; :attr:`series` itself when those are all.
        left_out: joints of the log that are not judged, but move judged ones or are moved by them.
    """

    series: UniformSeries
    robot: RobotModel
    rigid_nm: FloatArray | None
    commanded: CommandedTorque
    judged: tuple[str, ...]
    phases: NDArray[np.int8]
    gains: tuple[EffortGain, ...]
    sign_delay: Delay | None
    findings: tuple[Finding, ...]
    calibration: Calibration
    start: ConditionedLog
    quiet: tuple[ModelBandwidth, ...] = ()
    scale: tuple[Finding, ...] = ()
    effort_smoothing: Mapping[str, Smoothing] = field(default_factory=dict)
    upright: frozenset[str] = frozenset()
    judged_series: UniformSeries = field(init=False)
    left_out: list[str] = field(init=False)

    def __post_init__(self) -> None:
        others = [name for name in self.series.joint_names if name not in self.judged]
        chained = others if self.robot.bodies is None else self.robot.bodies.on_chain(others, self.judged)
        object.__setattr__(self, "judged_series", of_joints(self.series, self.judged))
        object.__setattr__(self, "left_out", chained)

    @property
    def contact_nm(self) -> FloatArray | None:
        """(n, j) torque of the commanded tool force, or None without a wrench."""
        return self.commanded.torque_nm

    @property
    def effort_source(self) -> EffortSource:
        """On which side of the gears the effort is measured."""
        return self.start.effort_kind.source

    @property
    def bandwidth_hz(self) -> float:
        """Up to where acceleration is no noise to any joint's model torque, Hz; at most that of the filters."""
        return min((one.bandwidth_hz for one in self.quiet), default=self.series.bandwidth_hz)

    @property
    def sliding(self) -> tuple[str, ...]:
        """Prismatic joints: forces in N, ways in m."""
        return self.robot.sliding

    @property
    def units(self) -> dict[str, str]:
        """By judged joint the unit of what its drive exerts."""
        return {joint: torque_unit_of(joint, self.robot.sliding) for joint in self.judged}

    def explained_nm(self, joint: str) -> FloatArray | None:
        """(n,) torque of a joint by the model: rigid body and commanded tool force; None without a model."""
        if self.rigid_nm is None:
            return None
        j, contact = self.series.column(joint), self.contact_nm
        return self.rigid_nm[:, j] if contact is None else self.rigid_nm[:, j] + contact[:, j]

    def sensed(self, joint: str) -> bool:
        """Whether the log has both torques of a joint, of the drive and behind the gear, in N·m."""
        series = self.series
        if series.joint_torque_nm is None or series.effort is None or series.effort_unit != "Nm":
            return False
        return bool(np.isfinite(series.joint_torque_nm[:, series.column(joint)]).any())

    def gear_torque(self, joint: str) -> FloatArray | None:
        """(n,) torque that a drive must bring up besides friction, N·m; None without sensor and model.

        A log with the drive's torque and that of a sensor behind the gear gives friction directly, as their difference,
        less what accelerates the rotor: tau_drive - tau_sensor = f(dq) + B ddq (Albu-Schäffer, Ott and Hirzinger, Int.
        J. Robotics Research 26, 2007, eq. (1)-(2)). No error of inertials, tool or contact is in it.
        """
        behind = self.series.joint_torque_nm
        if behind is None or not self.sensed(joint):
            return self.explained_nm(joint)
        j, bodies = self.series.column(joint), self.robot.bodies
        rotor = 0.0 if bodies is None else float(self.robot.armature[bodies.joint_names.index(joint)])
        return np.asarray(behind[:, j] + rotor * self.series.acceleration_rad_s2[:, j])

    def part(self, *spans: Span) -> Prepared:
        """The samples of some spans that follow each other, with the findings and checks of the whole log."""
        series, n = self.series, self.series.time_s.size
        if sum(map(len, spans)) >= n:
            return self
        rows = spans[0].slice if len(spans) == 1 else np.concatenate([np.arange(s.start, s.stop) for s in spans])

        def cut(value: Any) -> Any:
            of_samples = isinstance(value, np.ndarray) and value.shape[0] == n
            return value.T[..., rows].T if of_samples else value  # columns stay contiguous

        columns: dict[str, Any] = {f.name: cut(getattr(series, f.name)) for f in fields(UniformSeries)}
        columns["segments"] = tuple(_segments_in(spans, series.segments))
        return replace(
            self,
            series=UniformSeries(**columns),
            rigid_nm=cut(self.rigid_nm),
            commanded=replace(self.commanded, torque_nm=cut(self.commanded.torque_nm)),
            phases=cut(self.phases),
            quiet=tuple(replace(one, left_out_nm=cut(one.left_out_nm)) for one in self.quiet),
        )

    def columns(self) -> list[int]:
        """Columns of the judged joints."""
        return [self.series.column(joint) for joint in self.judged]

    def outline(self) -> Shown:
        """Judged joints, length, findings."""
        time_s = self.series.time_s
        rows = [
            ("judged", ", ".join(self.judged)),
            ("findings", first_few(dict.fromkeys(finding.code for finding in self.findings), 8)),
        ]
        return f"Prepared log, {len(time_s)} samples from {time_s[0]:.4g} to {time_s[-1]:.4g} s", rows


def _segments_in(spans: Sequence[Span], segments: Sequence[Span]) -> list[Span]:
    """What the spans have of each segment, where they lie one after the other."""
    found, before = list[Span](), 0
    for span in spans:
        for one in segments:
            start, stop = max(one.start, span.start), min(one.stop, span.stop)
            if start < stop:
                found.append(Span(before + start - span.start, before + stop - span.start))
        before += len(span)
    return found


#: Of a log or a series: what has a column for each joint.
_BY_JOINT = (
    "position_rad", "velocity_rad_s", "acceleration_rad_s2", "effort", "saturated", "raw_velocity_rad_s",
    "temperature_c", "joint_torque_nm",
)  # fmt: skip


def in_model_order(log: JointLog, robot: RobotModel) -> JointLog:
    """The log with the model's joints only, in the model's order."""
    pick = [log.joint_names.index(name) for name in robot.joint_names]
    if pick == list(range(len(log.joint_names))):
        return log
    return replace(log, joint_names=robot.joint_names, **_picked(log, pick))


def of_joints(series: UniformSeries, joints: tuple[str, ...]) -> UniformSeries:
    """The series with these of its joints only."""
    if len(joints) == len(series.joint_names):
        return series
    return replace(series, joint_names=joints, **_picked(series, [series.column(joint) for joint in joints]))


def _picked(signals: JointLog | UniformSeries, columns: Sequence[int]) -> dict[str, Any]:
    """Those of the signals that have a column for each joint, with some of the columns."""
    tables = ((name, getattr(signals, name, None)) for name in _BY_JOINT)
    return {name: np.asfortranarray(values[:, columns]) for name, values in tables if values is not None}
