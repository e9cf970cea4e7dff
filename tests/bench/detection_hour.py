"""An hour of a seven-axis arm with a wrist sensor, its friction and the pushes on it: what detection is timed on.

Motion and layout are those of ``bench_logs_data``; the efforts obey eq. (4) with the simulated arm ``seven``, so that
residuals mean something and the events are known.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import bench_logs_data as data
import numpy as np
import tomlkit
from mcap.writer import CompressionType

from collaudit.core.data.audit_result import FRICTION_SCHEMA, FrictionFile, Provenance
from collaudit.core.data.friction_result import FrictionFit
from collaudit.fixtures.arms import robot_named
from collaudit.reports.files.run_files import write_friction

ARM = robot_named("seven")
JOINTS = ARM.joints
PERIOD_S = 1.0 / data.RATE_HZ
GAMMA_NM, N, GAIN_PER_S = 4.0, 13, 60.0
SPEEDS_RAD_S = (0.02, 0.5)
#: Someone pushes this often, on one joint after the other, this hard and long.
EVERY_S, PUSH_NM, PUSH_S = 20.0, 9.0, 0.2
#: A push on a joint slower than this waits for the next turn: near a reversal friction hides part of it.
_MOVING_RAD_S = 0.2
Array = np.ndarray[Any, Any]


def friction_values() -> dict[str, dict[str, float]]:
    """A, B, C, D of eq. (11) of each joint."""
    out = {}
    for name, law in zip(JOINTS, ARM.friction, strict=True):
        side = law.forward
        rise = side.stiction_nm - side.coulomb_nm
        out[name] = {"A_nm": side.coulomb_nm, "B_nm": rise, "C_s_per_rad": 1.0 / side.stribeck_rad_s,
                     "D_nm_s_per_rad": side.viscous_nm_s_per_rad}  # fmt: skip
    return out


def friction_torque(v: Array) -> Array:
    """(n, 7) N·m of eq. (11) at velocities (n, 7)."""
    rows = [list(values.values()) for values in friction_values().values()]
    a, b, c, d = np.array(rows).T
    speed = np.abs(v)
    return np.sign(v) * (a + b * np.exp(-c * speed) + d * speed)


def pushes(velocity: Array) -> list[tuple[int, int]]:
    """(first sample, joint) of every push."""
    every = round(EVERY_S / PERIOD_S)
    starts = range(every // 2, velocity.shape[0] - every // 2, every)
    turns = [(start, k % len(JOINTS)) for k, start in enumerate(starts)]
    length = round(PUSH_S / PERIOD_S)
    return [(s, j) for s, j in turns if np.abs(velocity[s - 100 : s + length, j]).min() > _MOVING_RAD_S]


def signals(minutes: float) -> data.Made:
    """(n, 21) position, velocity, effort and (n, 6) wrench."""
    count = round(minutes * 60 * data.RATE_HZ)
    rng = np.random.default_rng(4)
    phase = 0.4 * PERIOD_S * np.arange(count)[:, None] + np.arange(len(JOINTS))
    q, v, a = np.sin(phase), 0.4 * np.cos(phase), -0.16 * np.sin(phase)
    wrench = np.zeros((count, 6))
    wrench[:, 2] = 20.0 + 5.0 * np.sin(phase[:, 0])
    model = ARM.model()
    torque = model.inverse_dynamics(q, v, a) + friction_torque(v) + model.wrench_torque(q, wrench, ARM.sensor_frame)
    shape = PUSH_NM * (0.5 - 0.5 * np.cos(2.0 * np.pi * np.linspace(0.0, 1.0, round(PUSH_S / PERIOD_S))))
    for start, joint in pushes(v):
        torque[start : start + shape.size, joint] += shape
    torque += rng.normal(0.0, 0.1, torque.shape)
    joints = np.hstack([q + rng.normal(0.0, 1e-6, q.shape), v + rng.normal(0.0, 1e-4, v.shape), torque])
    reading = wrench - model.tool_wrench(q, ARM.sensor_frame)
    return joints, reading + rng.normal(0.0, 0.1, wrench.shape)


def hour_log(minutes: float) -> Path:
    """The log, with its configuration, robot and friction beside it; made when it is not there."""
    path = data.cache_dir() / f"detect-{minutes:g}min.mcap"
    if not path.exists():
        its = data.messages(minutes, "cdr", signals(minutes))
        data.written(path, lambda part: data.mcap_file(part, its, CompressionType.ZSTD))
    description = ARM.describe(lambda: 0.0)
    assert description.urdf is not None
    path.with_suffix(".urdf").write_text(description.urdf, encoding="utf-8")
    names = dict(zip(data.NAMES, JOINTS, strict=True))
    tables: dict[str, object] = {
        "robot": {"urdf": path.with_suffix(".urdf").name, **description.keys},
        "log": {"joint_states": "/joint_states", "wrench": "/ft_sensor/wrench", "wrench_frame": ARM.sensor_frame,
                "wrench_bias": [0.0] * 6, "joint_names": names},
        "detect": {"detector": "momentum", "gamma_nm": GAMMA_NM, "n": N, "observer_gain_per_s": GAIN_PER_S},
        "friction": {"file": path.with_suffix(".friction.json").name},
    }  # fmt: skip
    path.with_suffix(".toml").write_text(tomlkit.dumps(tables), encoding="utf-8")
    _write_friction(path.with_suffix(".friction.json"))
    return path


def _write_friction(path: Path) -> None:
    joints = {
        name: FrictionFit(
            "static-lugre", values, dict.fromkeys(values), None, True, (), (), 30, 30, SPEEDS_RAD_S, 0.0, "N·m", ()
        )
        for name, values in friction_values().items()
    }
    write_friction(path, FrictionFile(FRICTION_SCHEMA, joints, (), Provenance("bench", {})))
