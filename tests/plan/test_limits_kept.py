"""A planned motion keeps every limit, by a sampler of its own; what cannot be planned is refused."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import plan_sampler as sampler
import pytest

pytest.importorskip("ruckig")

from collaudit.core.config import load_config
from collaudit.core.data.audit_result import Provenance
from collaudit.core.errors import CollauditError
from collaudit.core.plan.planning import Plan, PlanRequest, make_plan, move_check
from collaudit.reports.formats.plan_files import csv_text

NOTHING = Provenance("0", {})
ARM = """
[robot]
dh_convention = "standard"
dh = [
  { d = 0.3, alpha = 1.5707963267948966, mass_kg = 4.0, com_m = [0.0, -0.1, 0.0], inertia_kg_m2 = [0.03, 0.02, 0.03, 0, 0, 0], effort_limit_nm = 60 },
  { a = 0.4, mass_kg = 4.0, com_m = [-0.2, 0.0, 0.0], inertia_kg_m2 = [0.01, 0.06, 0.06, 0, 0, 0], effort_limit_nm = 60 },
  { a = 0.3, mass_kg = 2.0, com_m = [-0.15, 0.0, 0.0], inertia_kg_m2 = [0.01, 0.02, 0.02, 0, 0, 0], effort_limit_nm = 30 },
]
[plan]
start_rad = { joint2 = 1.2, joint3 = -1.0 }
position_rad = { joint1 = [-2.0, 2.0], joint2 = [-0.5, 2.5], joint3 = [-2.2, 2.2] }
speed_rad_s = { joint1 = 1.5, joint2 = 1.2, joint3 = 2.0 }
"""  # noqa: E501


def planned(folder: Path, more: str = "", request: PlanRequest | None = None) -> Plan:
    path = folder / "arm.toml"
    path.write_text(ARM + more)
    return make_plan(load_config(path), None, [], request or PlanRequest(minutes=1.0), NOTHING)


def checked(plan: Plan, table_z_m: float = 0.0) -> dict[str, float]:
    return sampler.limits_used(plan, csv_text(plan, plan.robot.joint_names), table_z_m)


@pytest.mark.parametrize("seed", [0, 1])
def test_every_limit_is_kept_at_1_khz(tmp_path: Path, seed: int) -> None:
    found = checked(planned(tmp_path, request=PlanRequest(minutes=1.0, seed=seed)))
    assert found["low"] >= 0 <= found["high"]
    assert max(found[key] for key in ("speed", "acceleration", "jerk", "torque")) <= 1.0
    assert found["speed"] > 0.8  # of use: the limits are used, not shunned
    assert found["apart"] >= 0.02 <= found["above"]
    assert found["start"] < 1e-9
    assert found["rest"] < 1e-2 and found["end"] < 1e-3
    assert 40.0 < found["duration"] <= 60.0


def test_a_wall_and_a_table_are_kept_clear_of(tmp_path: Path) -> None:
    box = "table_z_m = 0.1\nworkspace_m = [[-0.5, -0.3, 0.0], [1.0, 0.3, 1.5]]\n"
    plan = planned(tmp_path, box)
    assert checked(plan, 0.1)["above"] >= 0.02
    points = np.array(
        [plan.robot.frame_positions(pose, ["joint3", plan.robot.frame_names[-1]]) for pose in plan.motion.q]
    )
    assert np.abs(points[..., 1]).max() < 0.3
    free = planned(tmp_path)
    away = np.array([free.robot.frame_positions(pose, [free.robot.frame_names[-1]]) for pose in free.motion.q])
    assert np.abs(away[..., 1]).max() > 0.3  # the walls did matter


def test_scaled_speed_scales_all_rates(tmp_path: Path) -> None:
    plan = planned(tmp_path, request=PlanRequest(minutes=1.0, speed_scale=0.5))
    limit = plan.file.limits["joint1"]
    assert (limit.speed_rad_s, limit.acceleration_rad_s2, limit.jerk_rad_s3) == (0.75, 0.375, 0.9375)
    assert checked(plan)["speed"] <= 1.0


def test_all_joints_are_swept_at_once_along_a_line_and_back(tmp_path: Path) -> None:
    plan = planned(tmp_path)
    ends = np.array([[part.q[0], part.q[-1]] for part in plan.moves[: -plan.file.exciting_moves]])
    ways = ends[:, 1] - ends[:, 0]
    there_and_back = 0
    for way, back in pairwise(ways):
        if np.allclose(back, -0.9 * way):  # the same line; the next round begins a little farther along
            there_and_back += int(np.count_nonzero(np.abs(way) > 1e-3))
    pairs = [len(sweeps.speeds_rad_s) for sweeps in plan.file.sweeps]
    assert len(pairs) == 3 and sum(pairs) == there_and_back
    assert len(ways) < 3 * max(pairs)  # far fewer moves than two for every joint and speed


def test_the_time_of_a_program_is_that_of_its_longest_pairs() -> None:
    from collaudit.core.plan.sweeps import program_s

    assert program_s([[4.0, 2.0, 6.0], [5.0, 5.0]]) == 6.0 + 5.0 + 2.0


def test_joints_that_are_not_named_stay(tmp_path: Path) -> None:
    plan = planned(tmp_path, request=PlanRequest(minutes=0.5, joints=("joint2", "joint3")))
    assert np.ptp(plan.motion.q[:, 0]) == 0.0
    assert np.ptp(plan.motion.q[:, 1]) > 0.1


def test_friction_that_is_not_known_is_never_counted_on_to_brake(tmp_path: Path) -> None:
    path = tmp_path / "arm.toml"
    path.write_text(ARM)
    check, robot = move_check(load_config(path), None, 1.0)
    q, v, a = (size * np.random.default_rng(0).normal(size=(200, 3)) for size in (1.0, 0.5, 8.0))
    alone = np.abs(robot.inverse_dynamics(q, v, a))
    assert np.allclose(np.abs(check.torque_nm(q, v, a)), alone + 0.2 * check.limits.torque)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("speed_rad_s = { joint1 = 1.5, joint2 = 1.2, joint3 = 2.0 }", ""), "speed_rad_s"),
        (("position_rad = { joint1 = [-2.0, 2.0],", "position_rad = {"), "position_rad"),
        (("joint2 = 1.2, joint3 = -1.0", "joint2 = 3.2"), "start_rad"),
        (("joint2 = 1.2, joint3 = -1.0", "joint2 = -0.4, joint3 = 0.0"), "the table"),
        (("effort_limit_nm = 30", "effort_limit_nm = 0.5"), "hold its start"),
        (("[plan]", "[plan]\nworkspace_m = [[0, 0, 0], [0.2, 0.2, 0.2]]"), "workspace"),
        (("[plan]", "[plan]\nworkspace_m = [[0, 0, 0]]"), "workspace_m"),
        (("[plan]", "[plan]\ntorque_nm = { joint9 = 3.0 }"), "no such joint"),
    ],
)
def test_what_cannot_be_planned_is_refused(tmp_path: Path, change: tuple[str, str], said: str) -> None:
    path = tmp_path / "arm.toml"
    assert change[0] in ARM
    path.write_text(ARM.replace(*change))
    with pytest.raises(CollauditError) as error:
        make_plan(load_config(path), None, [], PlanRequest(minutes=0.5), NOTHING)
    assert said in str(error.value)
