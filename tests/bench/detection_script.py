"""What a competent user writes without this project: a message loop, ``pin.rnea`` in a loop, numpy, an observer.

It computes the very same as ``detector = "momentum"``: the rigid-body torque; with ``causal`` the textbook observer,
sample by sample; offline eq. (5) with zero-phase velocity and acceleration, and the observer's low-pass both
ways. Then rule (6).
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
from detection_hour import ARM, GAIN_PER_S, GAMMA_NM, JOINTS, PERIOD_S, N, friction_torque
from mcap_ros2.reader import read_ros2_messages
from scipy.signal import butter, sosfiltfilt

Array = np.ndarray[Any, Any]
_BANDWIDTH_HZ = 20.0


@dataclass
class Outcome:
    """Residual and rigid-body torque (n, 7) in N·m, alarms as (joint, sample of firing), seconds by stage."""

    residual_nm: Array
    rigid_nm: Array
    alarms: list[tuple[int, int]]
    seconds: dict[str, float] = field(default_factory=dict)


def run(path: Path, causal: bool) -> Outcome:
    """The whole script on one log."""
    marks = [time.perf_counter()]

    def mark() -> None:
        marks.append(time.perf_counter())

    q, dq, tau, wrench = decode(path)
    mark()
    model = arm(path.with_suffix(".urdf"))
    velocity = low_pass(dq)
    acceleration = np.gradient(velocity, PERIOD_S, axis=0)
    torque = tau - contact_torque(model, q, wrench) + rigid_torque(tool_alone(model), q, velocity, acceleration)
    mark()
    rigid = rigid_torque(model, q, velocity, acceleration)
    if causal:
        residual = observe(model, q, dq, torque - friction_torque(dq))
    else:
        residual = smooth(smooth(torque - rigid - friction_torque(velocity))[::-1])[::-1]
    mark()
    alarms = judge(residual)
    mark()
    stages = ("decode", "J^T F", "dynamics and observer", "rule")
    return Outcome(residual, rigid, alarms, dict(zip(stages, np.diff(marks), strict=True)))


def decode(path: Path) -> tuple[Array, Array, Array, Array]:
    """Message by message; the wrench is brought to the joints' stamps."""
    t, q, dq, tau, t_w, wrench = [], [], [], [], [], []
    for item in read_ros2_messages(str(path)):
        message = item.ros_msg
        stamp = message.header.stamp.sec * 10**9 + message.header.stamp.nanosec
        if item.channel.topic == "/joint_states":
            t.append(stamp)
            q.append(message.position)
            dq.append(message.velocity)
            tau.append(message.effort)
        else:
            f, m = message.wrench.force, message.wrench.torque
            t_w.append(stamp)
            wrench.append((f.x, f.y, f.z, m.x, m.y, m.z))
    start = t[0]
    when, when_w = (np.array(x) - start for x in (t, t_w))
    at_joints = np.stack([np.interp(when, when_w, column) for column in np.array(wrench).T], axis=1)
    return np.array(q), np.array(dq), np.array(tau), at_joints


def low_pass(x: Array) -> Array:
    """Second-order Butterworth forward and backward, -3 dB at 20 Hz for both passes together."""
    corner = 2.0 / math.pi * math.atan(math.tan(math.pi * _BANDWIDTH_HZ * PERIOD_S) / (math.sqrt(2.0) - 1.0) ** 0.25)
    settle = round(1.5 / (_BANDWIDTH_HZ * PERIOD_S))
    return np.asarray(sosfiltfilt(butter(2, corner, output="sos"), x, axis=0, padtype="odd", padlen=settle))


def arm(urdf: Path) -> Any:
    """The arm with its tool, tilted base and rotors."""
    model = pin.buildModelFromUrdf(str(urdf))
    keys = ARM.describe(lambda: 0.0).keys
    tilt = math.radians(keys["base_rpy_deg"][0])
    model.gravity.linear = pin.utils.rotate("x", tilt).T @ np.array([0.0, 0.0, -9.80665])
    model.armature = np.array([keys["armature_kg_m2"][name] for name in JOINTS])
    frame = model.frames[model.getFrameId(ARM.tool_frame)]
    tool = pin.Inertia(keys["tool"]["mass_kg"], np.array(keys["tool"]["com_m"]), np.zeros((3, 3)))
    model.appendBodyToJoint(frame.parentJoint, tool, frame.placement)
    return model


def tool_alone(model: Any) -> Any:
    """The arm without weight and without any mass but the tool's, whose inertia the wrist sensor feels."""
    alone = model.copy()
    alone.gravity.linear, alone.armature = np.zeros(3), np.zeros(len(JOINTS))
    for k in range(len(alone.inertias)):
        alone.inertias[k] = pin.Inertia.Zero()
    frame = alone.frames[alone.getFrameId(ARM.tool_frame)]
    keys = ARM.describe(lambda: 0.0).keys["tool"]
    tool = pin.Inertia(keys["mass_kg"], np.array(keys["com_m"]), np.zeros((3, 3)))
    alone.appendBodyToJoint(frame.parentJoint, tool, frame.placement)
    return alone


def rigid_torque(model: Any, q: Array, v: Array, a: Array) -> Array:
    """Inverse dynamics, sample by sample."""
    data, out = model.createData(), np.empty_like(q)
    for k in range(len(q)):
        out[k] = pin.rnea(model, data, q[k], v[k], a[k])
    return out


def contact_torque(model: Any, q: Array, reading: Array) -> Array:
    """J^T F, sample by sample, the tool's weight taken out of the reading."""
    data, out = model.createData(), np.empty_like(q)
    frame = model.getFrameId(ARM.sensor_frame)
    tool = ARM.describe(lambda: 0.0).keys["tool"]
    gravity, com = tool["mass_kg"] * model.gravity.linear, np.array(tool["com_m"])
    for k in range(len(q)):
        pin.forwardKinematics(model, data, q[k])
        jacobian = pin.computeFrameJacobian(model, data, q[k], frame, pin.LOCAL)
        weight = pin.updateFramePlacement(model, data, frame).rotation.T @ gravity
        out[k] = jacobian.T @ (reading[k] + np.concatenate([weight, np.cross(com, weight)]))
    return out


def weights() -> tuple[float, float, float]:
    """Of the last output, the new and the last input: K/(s + K), exact for inputs straight between samples."""
    decay = math.exp(-GAIN_PER_S * PERIOD_S)
    share = (1.0 - decay) / (GAIN_PER_S * PERIOD_S)
    return decay, 1.0 - share, share - decay


def smooth(x: Array) -> Array:
    """K/(s + K), forward."""
    (decay, new, old), out = weights(), np.empty_like(x)
    out[0] = x[0]
    for k in range(1, len(x)):
        out[k] = decay * out[k - 1] + new * x[k] + old * x[k - 1]
    return out


def observe(model: Any, q: Array, v: Array, torque: Array) -> Array:
    """The observer r = K [∫(torque + C^T v - G - r) dt - p] with p = M v, which is K/(s + K) of the inputs."""
    (decay, new, old), out = weights(), np.empty_like(q)
    data = model.createData()
    slow = last = np.zeros((2, q.shape[1]))
    for k in range(len(q)):
        mass = pin.crba(model, data, q[k])  # rotor inertia included
        p = np.triu(mass) @ v[k] + np.triu(mass, 1).T @ v[k]
        c = pin.computeCoriolisMatrix(model, data, q[k], v[k])
        u = torque[k] + c.T @ v[k] - pin.computeGeneralizedGravity(model, data, q[k])
        now = np.stack([u, p])
        slow = now if k == 0 else decay * slow + new * now + old * last
        out[k] = slow[0] - GAIN_PER_S * (p - slow[1])
        last = now
    return out


def judge(residual: Array) -> list[tuple[int, int]]:
    """Rule (6), counted joint by joint."""
    alarms = []
    for joint in range(residual.shape[1]):
        count = 0
        for k, value in enumerate(np.abs(residual[:, joint])):
            count = count + 1 if value > GAMMA_NM else 0
            if count == N:
                alarms.append((joint, k))
    return alarms
