"""The files of a plan: CSV, JointTrajectory as MCAP and YAML, URScript, a table; each says that it is a proposal."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.plan.moves import Motion
from collaudit.core.plan.planning import Plan
from collaudit.core.plan.sweeps import PAUSE_S
from collaudit.reports.files.run_files import result_json
from collaudit.reports.files.written_files import atomic_write, staged
from collaudit.reports.formats.ros_mcap import TRAJECTORY, Channel, joint_trajectory, write_mcap
from collaudit.reports.terminal.command_texts import plan_text
from collaudit.reports.values.visible_text import text_cell, visible

CSV_PERIOD_S = 0.01
_TOPIC = "/joint_trajectory"
_UR_JOINTS = 6
#: The way to the start is not planned: the program ends where the arm is anywhere else.
_START = """\
  at = get_actual_joint_positions()
  k = 0
  while k < 6:
    if norm(at[k] - start[k]) > 0.01:
      popup("The arm is not at the start of the planned motion. Move it there by hand or slowly.", "planned motion")
      halt
    end
    k = k + 1
  end"""


def write_plan(folder: Path, plan: Plan, names: Sequence[str], page: str) -> tuple[Path, ...]:
    """Write all files of a plan; returns them.

    Args:
        folder: made where it is missing.
        plan: the plan.
        names: of the joints, as the robot's controller calls them, in the plan's order.
        page: text of the page.

    Raises:
        CollauditError: a file cannot be written.
    """
    texts = {
        "plan.json": result_json(plan.file),
        "plan.html": page,
        "plan.txt": plan_text(plan.file),
        "motion.csv": csv_text(plan, names),
        "trajectory.yaml": yaml_text(plan, names),
    }
    if len(names) == _UR_JOINTS:
        texts["motion.script"] = script_text(plan)
    for name, text in texts.items():
        atomic_write(folder / name, text)
    with staged(folder / "trajectory.mcap") as path, path.open("xb") as file:
        message = joint_trajectory(names, plan.motion.time_s, plan.motion.q, plan.motion.v)
        channel = Channel(_TOPIC, TRAJECTORY, np.zeros(1, dtype=np.int64), [message])
        write_mcap(file, [channel], {"statement": plan.file.statement}, "collaudit")
    return (*(folder / name for name in texts), folder / "trajectory.mcap")


def csv_text(plan: Plan, names: Sequence[str]) -> str:
    """Time in s, positions in rad, velocities in rad/s, every 10 ms and at the knots; lines with # first."""
    t, q, v, _ = plan.motion.with_knots(CSV_PERIOD_S)
    out = io.StringIO()
    for line in (
        plan.file.statement,
        "time in s, q in rad (m), dq in rad/s (m/s), every 10 ms and where the jerk changes; cubic between rows",
    ):
        out.write(f"# {line}\n")
    shown = [*map(visible, names)]
    head = ["time", *(text_cell(f"q_{name}") for name in shown), *(text_cell(f"dq_{name}") for name in shown)]
    csv.writer(out, lineterminator="\n").writerow(head)
    # a jerk is a third difference: it needs the digits
    np.savetxt(out, np.column_stack([t, q, v]), fmt="%.15g", delimiter=",")
    return out.getvalue()


def yaml_text(plan: Plan, names: Sequence[str]) -> str:
    """A ``trajectory_msgs/JointTrajectory`` with the knots of the motion: cubic between them."""
    lines = [
        f"# {plan.file.statement}",
        "header: {frame_id: ''}",
        f"joint_names: [{', '.join(map(_quoted, names))}]",
        "points:",
    ]
    motion = plan.motion
    for time, q, v in zip(motion.time_s, motion.q, motion.v, strict=True):
        seconds, rest = divmod(round(1e9 * float(time)), 1_000_000_000)
        lines.append(
            f"- {{positions: {_row(q)}, velocities: {_row(v)}, time_from_start: {{sec: {seconds}, nanosec: {rest}}}}}"
        )
    return "\n".join(lines) + "\n"


def script_text(plan: Plan) -> str:
    """URScript: every move as a ``movej`` with the move's highest speed and acceleration of its leading joint.

    A controller rounds its ramps in its own way: the path and these two limits are the plan's, the jerk is not.
    """
    lines = [
        f"# {plan.file.statement}",
        "# The jerk of movej is the controller's own; path, speed and acceleration are the plan's.",
    ]
    lines += ["def planned_motion():", f"  start = {_row(plan.moves[0].q[0])}", *_START.splitlines()]
    for part in plan.moves:
        speed, acceleration = _leading(part)
        lines.append(f"  movej({_row(part.q[-1])}, a={acceleration:.5f}, v={speed:.5f})")
        lines.append(f"  sleep({PAUSE_S:g})")
    return "\n".join([*lines, "end", ""])


def _leading(part: Motion) -> tuple[float, float]:
    """Highest speed and acceleration of the joint with the longest way, rounded down."""
    j = int(np.argmax(np.abs(part.q[-1] - part.q[0])))
    steps = np.abs(np.diff(part.v[:, j]) / np.diff(part.time_s))
    return float(np.floor(1e5 * np.abs(part.v[:, j]).max()) / 1e5), float(np.floor(1e5 * steps.max()) / 1e5)


def _row(values: FloatArray) -> str:
    return f"[{', '.join(f'{x:.9g}' for x in values)}]"


def _quoted(name: str) -> str:
    return "'" + name.replace("'", "''") + "'"
