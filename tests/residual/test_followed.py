"""What is followed of friction and zero is kept beside the residual: both together are the residual by the fit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.api import prepare
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.signals import State
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.prepare.calibration import Calibration
from collaudit.core.prepare.preparation import calibrated
from collaudit.core.residual.detector import detector_named
from collaudit.core.residual.residual import ResidualInputs
from collaudit.fixtures.simulation import SimulatedFiles


def test_friction_off_its_calibration_is_followed_and_said(
    made: Callable[..., SimulatedFiles], friction_of: Callable[[str], FrictionFile]
) -> None:
    files, friction = made("free-clean", "paper6", duration_s=60.0), friction_of("paper6")
    settings = load_config(files.config)
    log = calibrated(prepare(files.log, settings), Calibration.of(friction, settings.config), settings.config)
    laws, _ = friction_models(friction.joints, log.judged_series)
    less = {"A": 0.8, "B": 0.8, "D": 0.8}
    weak = {j: replace(x, values={k: v * less.get(k, 1.0) for k, v in x.values.items()}) for j, x in laws.items()}
    found = detector_named("direct").residual(log, ResidualInputs(weak, frozenset()), settings.config.detect)
    for j, joint in enumerate(log.judged_series.joint_names[:3]):
        rows = found.state[:, j] == State.JUDGED
        off = 0.2 * laws[joint].torque(log.judged_series.velocity_rad_s[rows, j])
        share = float(off @ found.followed_nm[rows, j] / (off @ off))
        assert share == pytest.approx(1.0, abs=0.25), joint
        assert found.levels[joint].median == pytest.approx(1.25, abs=0.06)
        assert np.median(np.abs(found.torque_nm[rows, j])) < 0.5 * np.median(np.abs(off))
