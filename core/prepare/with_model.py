"""A prepared log seen through another model or another effort: model torque, gains and what they say, anew."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.data.uniform_series import UniformSeries
from collaudit.core.prepare.effort_gain import effort_gain_findings, effort_gains
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.robot.robot_model import RobotModel


def with_model(prepared: Prepared, robot: RobotModel, series: UniformSeries) -> Prepared:
    """The same log with another model and series; findings about the effort are those of the new ones.

    Args:
        prepared: the log.
        robot: with inertials.
        series: of the same samples.
    """
    rigid = robot.inverse_dynamics(series.position_rad, series.velocity_rad_s, series.acceleration_rad_s2)
    expected = rigid if prepared.contact_nm is None else rigid + np.nan_to_num(prepared.contact_nm)
    gains = tuple(g for g in effort_gains(series, expected) if g.joint in prepared.judged)
    kept = tuple(f for f in prepared.findings if not f.code.startswith("effort-") or f.code == "effort-delay")
    about = effort_gain_findings(gains, prepared.judged, series.effort_unit)
    if any(f.code == "effort-delay" for f in kept):  # signs mean nothing until the delay is taken off
        about = [f for f in about if f.code != "effort-sign-inverted"]
    return replace(prepared, series=series, robot=robot, rigid_nm=rigid, gains=gains, findings=(*kept, *about))
