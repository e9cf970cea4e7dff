"""Where joints, tool and links were at the moments of contacts, how fast they moved, with what lever arms; and what the
arm did in the second after: facts of the log, and no conformity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from collaudit.core.data.detection_result import AfterContact, ContactScene, LoadKind
from collaudit.core.data.signals import ArmGeometry, State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.core.numeric.arrays import FloatArray, lasting
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel

#: The tool's velocity is a difference of its positions this long before and after, at constant joint velocity, s.
_STEP_S = 1e-4


def scene_at(prepared: Prepared, sample: int, frames: Sequence[str]) -> ContactScene | None:
    """Pose and speeds at a sample.

    Args:
        prepared: the log and its model.
        sample: of the uniform series.
        frames: of :func:`stick_frames`.

    Returns:
        None without a kinematic model, or where a position is not known.
    """
    robot, series = prepared.robot, prepared.series
    q, v = series.position_rad[sample], series.velocity_rad_s[sample]
    if not frames or not np.isfinite(q).all():
        return None
    points = robot.frame_positions(q, frames)
    columns = dict(zip(prepared.judged, prepared.columns(), strict=True))
    speed = None
    if np.isfinite(v).all():
        before, after = (robot.frame_positions(q + step * v, frames[-1:])[0] for step in (-_STEP_S, _STEP_S))
        speed = float(np.linalg.norm(after - before) / (2 * _STEP_S))
    return ContactScene(
        time_s=float(series.time_s[sample]),
        points_m=tuple(_point(point) for point in points),
        tool_frame=frames[-1],
        tool_speed_m_s=speed,
        joint_speed_rad_s={joint: float(v[k]) if np.isfinite(v[k]) else None for joint, k in columns.items()},
        joint_position_rad={joint: float(q[k]) for joint, k in columns.items()},
    )


def stick_frames(robot: RobotModel, tool: str | None) -> list[str]:
    """A frame at every joint, base to tip, and the tool's; none without a description.

    Args:
        robot: with or without a description.
        tool: its frame; None: the frame of the last link that is furthest out.
    """
    outer = tool if tool in robot.frame_names else robot.outer_frame(robot.joint_names[-1])
    return [frame for frame in (*map(robot.frame_at, robot.joint_names), outer) if frame is not None]


def arm_geometry(prepared: Prepared, tool: str | None) -> ArmGeometry | None:
    """The arm's kinematics for drawings.

    Args:
        prepared: the log and its model.
        tool: as of :func:`stick_frames`.

    Returns:
        None without a description, and where a joint moves whose position the result does not hold.
    """
    robot, bodies = prepared.robot, prepared.robot.bodies
    frames = stick_frames(robot, tool)
    moved_by = [[robot.joint_names[c] for c in np.flatnonzero(row)] for row in robot.expansion]
    if bodies is None or not frames or any(len(names) > 1 or {*names} - {*prepared.judged} for names in moved_by):
        return None
    moves = zip(bodies.links, moved_by, robot.expansion.sum(axis=1).tolist(), robot.offset.tolist(), strict=True)
    end = bodies.place_on_link(frames[-1])
    return ArmGeometry(
        links=tuple(
            replace(link, joint=names[0] if names else None, factor=factor, offset=offset)
            for link, names, factor, offset in moves
        ),
        tool_link=end.link,
        tool_m=_point(end.origin_m),
    )


def _point(xyz: FloatArray) -> tuple[float, float, float]:
    x, y, z = xyz.tolist()
    return x, y, z


class ArmAtSamples:
    """The arm at the samples where contacts are looked at.

    A lever arm costs some hundred calls of NumPy, whether for one sample or for a hundred: those of a frame are
    computed when it is first asked for, for all samples together.
    """

    def __init__(self, prepared: Prepared, samples: Sequence[int] = (), tool: str | None = None) -> None:
        """``samples``: of the log; ``tool``: frame of the tool, None for the last link's frame that is furthest out."""
        robot = prepared.robot
        self.robot, self.judged = robot, prepared.judged
        #: For each judged joint its column among the arm's.
        self.columns = [robot.joint_names.index(joint) for joint in prepared.judged]
        #: Whether phases of the run are known.
        self.phases_known = bool((prepared.phases > 0).any())
        #: For each joint of the arm a frame of the link that it moves.
        self.links = [robot.link_of(joint) for joint in robot.joint_names]
        #: Frames at every joint, base to tip, and the tool's; none without a description.
        self.stick = stick_frames(robot, tool)
        #: A frame of every place on the links; of those at one place the first.
        self.link_frames = _link_frames(robot)
        position = prepared.series.position_rad
        known = [k for k in dict.fromkeys(samples) if np.isfinite(position[k]).all()]
        self._place = {k: place for place, k in enumerate(known)}
        self._position_rad = position[known]
        self._arms: dict[str, FloatArray] = {}

    def rotation(self, frame: str, sample: int) -> FloatArray:
        """(3, 3) axes of a frame in the base at one of the samples."""
        return self.robot.frame_rotation(self._position_rad[self._place[sample]], frame)

    def position_known(self, sample: int) -> bool:
        """Whether the position of every joint is known at one of the samples."""
        return sample in self._place

    def points_of_link(self, link: int, sample: int) -> list[FloatArray]:
        """(3, j) torque of the arm's joints per newton along each base axis, at points on the link's line.

        It runs from the joint that moves the link to the next one, or to the tool. A lever arm is linear along it.
        Joints beyond the link are no part of it: their columns mean nothing.
        """
        ends = [self.rotation(frame, sample) @ self.lever_arms(frame, sample) for frame in self.stick[link : link + 2]]
        return [(1.0 - share) * ends[0] + share * ends[-1] for share in (0.0, 0.5, 1.0)] if ends else []

    def lever_arms(self, frame: str, sample: int) -> FloatArray:
        """(3, j) torque of the arm's joints per newton along each axis of a frame; the position is known there."""
        if frame not in self._arms:
            self._arms[frame] = self.robot.torque_per_newton(self._position_rad, frame)
        return np.asarray(self._arms[frame][self._place[sample]].T)


def _link_frames(robot: RobotModel) -> list[str]:
    found: dict[tuple[object, ...], str] = {}
    bodies = robot.bodies
    if bodies is None:
        return []
    for frame in bodies.frame_names:
        place = np.round(bodies.frame_in_joint(frame)[1], 6)
        found.setdefault((bodies.frame_joint(frame), *place.tolist()), frame)
    return list(found.values())


#: How long after the onset the arm is looked at, and over how long before it its speed is taken, s.
_AFTER_S, _BEFORE_S = 1.0, 0.05
#: A force kept for longer than this presses (quasi-static), else it is transient: ISO/TS 15066, 5.5.4, s.
PRESSED_S = 0.5
#: The tool has stopped when it stays this long below this share of its speed at the onset; slower ones stand, m/s.
_STOPPED_S, _STOPPED, _STANDING_M_S = 0.1, 0.05, 0.002
#: It has slowed below this share of its speed; slowing begins when it is below the second for good.
_SLOWED, _SLOWING = 0.7, 0.9


def after_contact(
    prepared: Prepared, run: DetectorRun, joints: Sequence[str], onset_s: float, end_s: float, tool: str | None
) -> AfterContact:
    """What the tool did after a contact, and how long the force was kept.

    Args:
        prepared: the log and its model.
        run: the states of its samples.
        joints: those that alarmed.
        onset_s, end_s: first and last sample above γ.
        tool: its frame; None without a kinematic model.
    """
    series = prepared.judged_series
    before, onset, last = np.searchsorted(
        series.time_s, [onset_s - _BEFORE_S, onset_s, onset_s + _AFTER_S + _STOPPED_S + 0.5 * series.period_s]
    ).tolist()
    load = _load(run, [series.column(joint) for joint in joints], series.time_s, onset_s, end_s)
    after = AfterContact("unknown", end_s - onset_s, load)
    if tool is None:
        return after
    q, v = prepared.series.position_rad[before:last], prepared.series.velocity_rad_s[before:last]
    speed = np.linalg.norm(np.einsum("njx,nj->nx", prepared.robot.torque_per_newton(q, tool), v), axis=1)
    earlier, later = speed[: max(1, onset - before)], speed[onset - before :]
    return _with_motion(after, float(np.mean(earlier)), later, series.period_s)


def _with_motion(after: AfterContact, speed_m_s: float, later: FloatArray, period_s: float) -> AfterContact:
    """With the tool's speed at the onset and at the samples (n,) from then on, m/s; unknown where one is missing."""
    within, still = round(_AFTER_S / period_s), max(1, round(_STOPPED_S / period_s))
    if not np.isfinite(speed_m_s):
        return after
    after = replace(after, speed_m_s=speed_m_s)
    below = later < max(_STOPPED * speed_m_s, _STANDING_M_S)
    stops = np.flatnonzero(lasting(below, still)[: within + 1])
    known = later[: stops[0] + 1] if stops.size else later[: within + 1]
    if not np.isfinite(known).all() or (not stops.size and len(later) < within):
        return after
    if speed_m_s < _STANDING_M_S:
        return replace(after, motion="stood")
    share = known / speed_m_s
    slowest = int(np.argmin(share))
    if share[slowest] >= _SLOWED:
        return replace(after, motion="went on", slowest=float(share[slowest]))
    fast = np.flatnonzero(share[: slowest + 1] >= _SLOWING)
    slowing_s = period_s * (int(fast[-1]) + 1 if fast.size else 0)
    after = replace(after, slowest=float(share[slowest]), slowing_s=slowing_s)
    if not stops.size:
        return replace(after, motion="turned back" if below[slowest] else "slowed")
    stop = int(stops[0])
    return replace(
        after, motion="stopped", stopped_s=period_s * stop, stopping_m=period_s * float(np.sum(later[:stop]))
    )


def _load(run: DetectorRun, columns: Sequence[int], time_s: FloatArray, onset_s: float, end_s: float) -> LoadKind:
    """How the force acted; unknown where its joints stop being judged by their value before it is decided."""
    if end_s - onset_s > PRESSED_S:
        return "quasi-static"
    a, b = np.searchsorted(time_s, [end_s, onset_s + PRESSED_S])
    told = b < len(time_s) and (run.detected.state[a : b + 1][:, columns] == State.JUDGED).all()
    return "transient" if told else "unknown"
