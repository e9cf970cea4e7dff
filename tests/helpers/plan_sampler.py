"""An independent look at a planned motion: its CSV at 1 kHz against every limit, without the planner's code.

Positions between rows are cubic (Hermite); torques come from the robot model; links are capsules between the joints'
origins, whose distances are worked out here.
"""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from itertools import combinations

import numpy as np

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.plan.planning import Plan
from collaudit.core.robot.robot_model import RobotModel

Array = np.ndarray


def read_motion(text: str) -> tuple[Array, Array, Array, list[str]]:
    """Times (n,), positions and velocities (n, j), and names of the joints."""
    head, _, rows = "".join(x for x in text.splitlines(True) if not x.startswith("#")).partition("\n")
    names = [name.removeprefix("q_") for name in head.split(",") if name.startswith("q_")]
    data = np.loadtxt(io.StringIO(rows), delimiter=",", ndmin=2)
    return data[:, 0], data[:, 1 : 1 + len(names)], data[:, 1 + len(names) :], names


def at_1_khz(t: Array, q: Array, v: Array) -> tuple[Array, Array, Array, Array]:
    """Positions, velocities, accelerations (n, j) of the cubics through the rows, every millisecond; jerks between."""
    time = np.arange(t[0], t[-1], 1e-3)
    k = np.clip(np.searchsorted(t, time, side="right") - 1, 0, t.size - 2)
    h = (t[k + 1] - t[k])[:, None]
    s = (time - t[k])[:, None]
    way, first, last = (q[k + 1] - q[k]) / h, v[k], v[k + 1]
    c, d = (3 * way - 2 * first - last) / h, (first + last - 2 * way) / h**2
    acceleration = 2 * c + 6 * s * d
    jerk = np.diff(acceleration, axis=0) / 1e-3
    return q[k] + s * (first + s * (c + s * d)), first + s * (2 * c + 3 * s * d), acceleration, jerk


def worst(values: Array, limit: Array) -> float:
    """The largest share of a limit that is used; above 1 is a violation."""
    return float(np.max(np.abs(values) / limit))


def segment_distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """(n,) least distances of segments a-b and c-d, all (n, 3) (Ericson, Real-Time Collision Detection, 5.1.9)."""
    u, w, r = b - a, d - c, a - c
    uu, ww, uw = (u * u).sum(1), (w * w).sum(1), (u * w).sum(1)
    ur, wr = (u * r).sum(1), (w * r).sum(1)
    tiny = 1e-12
    s = np.clip((uw * wr - ur * ww) / np.maximum(uu * ww - uw**2, tiny), 0.0, 1.0)
    t = (uw * s + wr) / np.maximum(ww, tiny)
    t = np.clip(t, 0.0, 1.0)
    s = np.clip((uw * t - ur) / np.maximum(uu, tiny), 0.0, 1.0)
    return np.linalg.norm(r + s[:, None] * u - t[:, None] * w, axis=1)


def nearest(
    ends: Mapping[str, tuple[Array, Array]], radius: Mapping[str, float], left_out: set[frozenset[str]]
) -> float:
    """Least distance of two capsules over all samples, m, pairs in ``left_out`` apart."""
    least = np.inf
    for one, two in combinations(ends, 2):
        if frozenset((one, two)) not in left_out:
            gap = segment_distance(*ends[one], *ends[two]) - radius[one] - radius[two]
            least = min(least, float(gap.min()))
    return least


def lowest(
    ends: Mapping[str, tuple[Array, Array]], radius: Mapping[str, float], table_z_m: float, fixed: set[str]
) -> float:
    """Least height of a capsule over the table, m."""
    return min(
        float(np.minimum(a[:, 2], b[:, 2]).min()) - radius[name] - table_z_m
        for name, (a, b) in ends.items()
        if name not in fixed
    )


def limits_used(
    plan: Plan, text: str, table_z_m: float, places: int = 4000, friction: FrictionFile | None = None
) -> dict[str, float]:
    """Shares of the limits that a plan's CSV uses, and distances in m; the shapes of a description are not looked at.

    Args:
        plan: its limits and its robot.
        text: the CSV.
        table_z_m: height of the table.
        places: evenly spaced in time, at which links are looked at.
        friction: laws that the torque counts with the model's; None for the model's alone.
    """
    t, q, v, names = read_motion(text)
    assert names == list(plan.robot.joint_names)
    q, v, a, jerk = at_1_khz(t, q, v)
    limits = [plan.file.limits[name] for name in names]

    def top(key: str) -> Array:
        return np.array([getattr(one, key) for one in limits])

    torque = plan.robot.inverse_dynamics(q, v, a)
    if friction is not None:
        torque = torque + friction_nm(friction, names, v)
    ends = _capsule_ends(plan.robot, q[np.unique(np.linspace(0, len(q) - 1, places).astype(int))])
    near = [pair.replace("the link of ", "").replace("the base", "base").split(" and ") for pair in plan.file.unchecked]
    radius = plan.file.capsules_m
    return {
        "low": float(np.min(q - top("low_rad"))),
        "high": float(np.min(top("high_rad") - q)),
        "speed": worst(v, top("speed_rad_s")),
        "acceleration": worst(a, top("acceleration_rad_s2")),
        "jerk": worst(jerk, top("jerk_rad_s3")),
        "torque": worst(torque, top("torque_nm")),
        "apart": nearest(ends, radius, {frozenset(pair) for pair in near}),
        "above": lowest(ends, radius, table_z_m, {"base", names[0]}),
        "start": float(np.abs(q[0] - top("start_rad")).max()),
        "rest": float(max(np.abs(v[0]).max(), np.abs(v[-1]).max())),
        "end": float(np.abs(q[-1] - q[0]).max()),
        "duration": float(t[-1]),
    }


def friction_nm(friction: FrictionFile, names: Sequence[str], v: Array) -> Array:
    """(n, j) friction of joints whose law is static LuGre or its parts: (A + B exp(-C |v|)) sgn v + D v; else none."""
    out = np.zeros_like(v)
    for j, name in enumerate(names):
        fit = friction.joints[name]
        value = {key.partition("_")[0]: float(x) for key, x in fit.parameters.items()}
        if fit.model in ("static-lugre", "coulomb-viscous"):
            speed = np.abs(v[:, j])
            fading = value.get("B", 0.0) * np.exp(-value.get("C", 0.0) * speed)
            size = value.get("A", 0.0) + fading + value.get("D", 0.0) * speed
            out[:, j] = np.sign(v[:, j]) * size
    return out


def _capsule_ends(robot: RobotModel, q: Array) -> dict[str, tuple[Array, Array]]:
    """Ends of the capsules of base and links: from joint to joint, the last one to its farthest frame.

    A product of exponentials (Lynch and Park, Modern Robotics, 4.1) of axes and places at rest.
    """
    joints = list(robot.joint_names)
    assert robot.bodies is not None
    last = [frame for frame in robot.frame_names if robot.bodies.frame_joint(frame) == joints[-1]]
    tip = max(last, key=robot.distance_in_joint)
    rest = np.zeros(len(joints))
    places = robot.frame_positions(rest, [*joints, tip])
    rotation, shift, ends = np.tile(np.eye(3), (len(q), 1, 1)), np.zeros((len(q), 3)), [np.zeros((len(q), 3))]
    for k, name in enumerate(joints):
        ends.append(shift + rotation @ places[k])
        turned = rest.copy()
        turned[k] = 0.5 * np.pi
        quarter = robot.frame_rotation(turned, name) @ robot.frame_rotation(rest, name).T
        cross = 0.5 * (quarter - quarter.T)  # of a quarter turn: the axis' cross product
        sine, cosine = np.sin(q[:, k])[:, None, None], np.cos(q[:, k])[:, None, None]
        turn = np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)
        shift = shift + np.einsum("nij,njk,k->ni", rotation, np.eye(3) - turn, places[k])
        rotation = rotation @ turn
    ends.append(shift + rotation @ places[-1])
    return {name: (ends[k], ends[k + 1]) for k, name in enumerate(["base", *joints])}
