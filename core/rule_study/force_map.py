"""Where on its way the arm notices how small a force, and from where it feels none at all."""

from __future__ import annotations

import numpy as np

from collaudit.core.data.rule_study_result import BlindPose, ForceCell, ForceMap
from collaudit.core.numeric.arrays import BoolArray, FloatArray, IntArray
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.verdict.arm_places import Place, arm_places, directions

#: A direction that needs more than this is called blind.
LIMIT_N = 500.0
#: Edge of the cells, doubled until there are no more than so many.
_CELL_M, _MOST_CELLS = 0.1, 150
_MOST_DIRECTIONS = 0.95
#: A direction this close to an axis is called by its name.
_ALONG = 0.94


def force_map(prepared: Prepared, detectable_nm: FloatArray, samples: IntArray, tool: str | None) -> ForceMap | None:
    """Smallest noticeable force over the poses of a log.

    A force of f newton from direction d gives joint j the torque f J_j · d, and alarms where that exceeds what is
    detectable there.

    Args:
        prepared: the log and its model.
        detectable_nm: (k, j) smallest torque of each judged joint that alarms, infinite where none does.
        samples: (k,) of the log.
        tool: frame of the tool.

    Returns:
        None without a kinematic model or a moment at which anything was judged.
    """
    robot = prepared.robot
    known = np.isfinite(prepared.series.position_rad[samples]).all(axis=1) & np.isfinite(detectable_nm).any(axis=1)
    there = arm_places(robot, prepared.judged, tool)
    if not there or not known.any():
        return None
    samples, level = samples[known], np.full((int(known.sum()), len(robot.joint_names)), np.inf)
    level[:, prepared.columns()] = detectable_nm[known]
    felt = {place: _felt(prepared, place, samples, level) for place in there}
    blind = [_blind(prepared, place, samples, shares) for place, (shares, _) in felt.items()]
    shares, origin = felt[there[-1]]
    edge, cells = _cells(origin, shares)
    return ForceMap(edge, LIMIT_N, cells, tuple(found for found in blind if found is not None))


def _felt(prepared: Prepared, place: Place, samples: IntArray, level: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(k, d) share of its threshold that a newton from each direction (base axes) brings the best joint to; (k, 3)."""
    robot = prepared.robot
    q = prepared.series.position_rad[samples]
    arms = robot.torque_per_newton(q, place.frame)[:, list(place.columns)]
    turns = np.stack([robot.frame_rotation(pose, place.frame) for pose in q])
    origin = np.concatenate([robot.frame_positions(pose, [place.frame]) for pose in q])
    in_base = arms @ turns.transpose(0, 2, 1)
    torque = np.abs(in_base @ directions())
    with np.errstate(divide="ignore"):  # of a threshold of 0, infinitely many
        return (torque / level[:, list(place.columns), None]).max(axis=1), origin


def _cells(origin: FloatArray, shares: FloatArray) -> tuple[float, tuple[ForceCell, ...]]:
    """Cells of space that the tool was in."""
    edge = _CELL_M
    while True:
        index = np.floor(origin / edge).astype(np.int64)
        found, member = np.unique(index, axis=0, return_inverse=True)
        if len(found) <= _MOST_CELLS:
            break
        edge *= 2.0
    place = int(np.ceil((1.0 - _MOST_DIRECTIONS) * shares.shape[1])) - 1
    most = np.partition(shares, place, axis=1)[:, place]
    cells = []
    for k, corner in enumerate(found):
        rows = member.ravel() == k
        centre = (corner + 0.5) * edge
        x, y, z = (round(float(value), 4) for value in centre)
        cells.append(ForceCell((x, y, z), int(rows.sum()), _force(float(np.median(most[rows])))))
    return edge, tuple(cells)


def _blind(prepared: Prepared, place: Place, samples: IntArray, shares: FloatArray) -> BlindPose | None:
    """The pose with most blind directions at a place; None without any."""
    blind: BoolArray = shares < 1.0 / LIMIT_N
    if not blind.any():
        return None
    row = int(np.argmax(blind.sum(axis=1)))
    column = int(np.argmin(shares[row]))
    return BlindPose(
        place=place.words,
        time_s=float(prepared.series.time_s[samples[row]]),
        words=direction_words(directions()[:, column]),
        force_n=_force(float(shares[row, column])),
        share=float(blind.any(axis=1).mean()),
    )


def direction_words(direction: FloatArray) -> str:
    """A direction in base axes for a reader; the opposite one feels alike."""
    names = ("forwards or backwards (x)", "sideways (y)", "up or down (z)")
    size = np.abs(direction)
    if size.max() >= _ALONG:
        return names[int(np.argmax(size))]
    return "along ({:.2f}, {:.2f}, {:.2f})".format(*direction)


def _force(share: float) -> float | None:
    """Of a share a newton; None where it is beyond any reason."""
    return float(f"{1.0 / share:.3g}") if share > 1e-5 else None
