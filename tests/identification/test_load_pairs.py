"""Two logs that differ by a known load tell drive gains, whatever the inertials are; alike loads tell none."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from identified import identify

from collaudit.core import api
from collaudit.core.config import LoadedConfig, load_config
from collaudit.core.identification.identification import identified_findings
from collaudit.core.prepare.calibration import KnownLoad
from collaudit.core.prepare.preparation import loaded, prepare
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.arms import robot_named
from collaudit.fixtures.simulation import SimulatedFiles

Maker = Callable[..., SimulatedFiles]
GAIN = np.array([0.8, 1.3, 0.7, 1.2, 0.9, 1.15])
LOAD = KnownLoad(3.0, (0.02, 0.0, 0.06))


def logs(made: Maker, loads: tuple[KnownLoad, KnownLoad], rubbing: float = 0.0) -> tuple[list[Prepared], LoadedConfig]:
    """Two runs with drives of wrong gains, the second one really carrying LOAD; the robot file is wrong by 15 %.

    ``rubbing``: friction that the load adds, as a share of its torque.
    """
    out = []
    for seed, (stated, real) in enumerate(zip(loads, (KnownLoad(0.0), LOAD), strict=True), start=31):
        files = made("free-clean", "paper6", seed, duration_s=24.0, mismatch_percent=15.0)
        settings = load_config(files.config, {"fit.estimate": ["friction", "gain"]})
        true = robot_named("paper6").model()
        log = api.open_log(files.log, settings)
        prepared = prepare(log, replace(api.load_robot(settings, log.joint_names), bodies=true.bodies), settings.config)
        carried = loaded(prepared, real, settings.config).start.load_nm
        assert carried is not None
        at = np.clip(np.searchsorted(prepared.series.time_s, log.time_s), 0, carried.shape[0] - 1)
        assert log.effort is not None
        borne = np.nan_to_num(carried[at])
        way = np.sign(np.nan_to_num(prepared.series.velocity_rad_s[at]))
        effort = (log.effort + borne + rubbing * np.abs(borne) * way) * GAIN
        again = prepare(replace(log, effort=effort), api.load_robot(settings, log.joint_names), settings.config)
        out.append(loaded(again, stated, settings.config))
    return out, settings


@pytest.mark.parametrize("rubbing", [0.0, 0.3])
def test_a_known_load_tells_gains_that_wrong_inertials_hide(made: Maker, rubbing: float) -> None:
    prepared, settings = logs(made, (KnownLoad(0.0), LOAD), rubbing)
    found = identify(prepared, settings.config)
    assert found is not None
    told = [name for name, joint in found.joints.items() if joint.gain_by_load]
    assert {"joint2", "joint3"} <= set(told)
    for name in told:
        low, high = found.joints[name].gain_ci95 or (None, None)
        assert low is not None
        assert high is not None
        true = GAIN[int(name[-1]) - 1]
        assert low < true < high, name
        assert high - low < 0.4 * true
    (said,) = [f for f in identified_findings(found) if f.is_fact and f.joint is None]
    assert said.text.startswith(f"The known loads of the logs determine the drive gains of {', '.join(told)}")


def test_loads_that_do_not_differ_tell_nothing(made: Maker) -> None:
    prepared, settings = logs(made, (LOAD, LOAD))
    found = identify(prepared, settings.config)
    assert found is not None
    assert not any(joint.gain_by_load for joint in found.joints.values())


def test_a_known_load_is_part_of_the_torque_of_the_model(made: Maker) -> None:
    files = made("free-clean", "paper6", 31, duration_s=12.0)
    settings = load_config(files.config)
    without = api.prepare(files.log, settings)
    carried = loaded(without, LOAD, settings.config)
    assert without.rigid_nm is not None and carried.rigid_nm is not None
    np.testing.assert_allclose(carried.rigid_nm - without.rigid_nm, carried.start.load_nm, atol=1e-9)
    assert np.nanmax(np.abs(carried.start.load_nm)) > 10.0


@pytest.mark.parametrize("text", ["", "heavy", "1,2", "-1", "1,nan,0,0"])
def test_what_is_no_load_is_refused(text: str, tmp_path: Path) -> None:
    from collaudit.cli.shared_steps import known_loads
    from collaudit.core.errors import ConfigError

    with pytest.raises(ConfigError):
        known_loads([text], 1)
    assert known_loads(["2.5,0,0,0.1"], 1) == [KnownLoad(2.5, (0.0, 0.0, 0.1))]
    with pytest.raises(ConfigError, match="some of the inputs"):
        known_loads(["1"], 2)
