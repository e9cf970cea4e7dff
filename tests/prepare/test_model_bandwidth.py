"""The model torque is used as far up as the effort contains it, and not where it is noise."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from collaudit.core import api
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.friction.joint_fits import friction_models
from collaudit.core.prepare.model_bandwidth import quiet_model
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.detector import detector_named, direct_kernel
from collaudit.core.residual.residual import ResidualInputs
from collaudit.fixtures.compare import audit_simulated
from collaudit.fixtures.simulation import SimulatedFiles

Maker = Callable[..., SimulatedFiles]
Fitted = Callable[[str], FrictionFile]


def prepared_of(files: SimulatedFiles) -> Prepared:
    return api.prepare(list(files.log), load_config(files.config))


def test_a_well_sampled_log_stays_as_it_is(made: Maker, robot: str) -> None:
    log = prepared_of(made("free-clean", robot, duration_s=20.0))
    assert log.rigid_nm is not None
    out, said = quiet_model(log.series, log.rigid_nm, log.contact_nm)
    assert out is log.rigid_nm
    assert not said


def test_noise_in_the_acceleration_is_not_subtracted(made: Maker, friction_of: Fitted) -> None:
    """100 Hz and coarse positions: the residual is smaller than with the filters' bandwidth, and that is said."""
    files = made("free-clean", "paper6", duration_s=20.0, imperfections=("slow-currents",))
    result = audit_simulated(files, friction_of("paper6")).result
    text = next(f.text for f in result.findings if f.text.startswith("The acceleration is too noisy"))
    assert "joint2" in text
    log = prepared_of(files)
    assert log.series.effort is not None
    assert log.rigid_nm is not None
    motion = (log.series.position_rad, log.series.velocity_rad_s, log.series.acceleration_rad_s2)
    noisy = log.robot.inverse_dynamics(*motion)
    quiet, with_noise = (np.nanstd(log.series.effort - model, axis=0)[1] for model in (log.rigid_nm, noisy))
    assert quiet < with_noise


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_what_the_effort_contains_is_kept_whatever_its_sign(made: Maker, sign: float) -> None:
    log = prepared_of(made("free-clean", "paper6", duration_s=20.0))
    assert log.rigid_nm is not None
    rng = np.random.default_rng(0)
    noise = 3.0 * rng.standard_normal(log.rigid_nm.shape)
    noisy = np.asarray(log.rigid_nm + noise)
    assert not quiet_model(replace(log.series, effort=sign * noisy), noisy, None)[1]
    out, said = quiet_model(replace(log.series, effort=np.asarray(log.rigid_nm)), noisy, None)
    assert all(one.bandwidth_hz < log.series.bandwidth_hz for one in said)
    assert np.nanstd(out - log.rigid_nm) < 0.8 * np.nanstd(noise)


def test_contact_does_not_change_what_is_noise(made: Maker) -> None:
    """Pushes of 20 N·m in a third of the time, where the upper bands are noise: at most one step of the bands.

    A log at 30 Hz with eight pushes kept all bands of its model, and alarmed between the pushes.
    """
    log = prepared_of(made("free-clean", "paper6", duration_s=20.0, imperfections=("slow-currents",)))
    motion = (log.series.position_rad, log.series.velocity_rad_s, log.series.acceleration_rad_s2)
    noisy = log.robot.inverse_dynamics(*motion)
    assert log.series.effort is not None
    pushes = 20.0 * ((log.series.time_s % 3.0 < 0.25) | (log.series.time_s % 3.0 > 2.25))
    touched = replace(log.series, effort=log.series.effort + pushes[:, None])
    clean, found = ({b.joint: b for b in quiet_model(x, noisy, None)[1]} for x in (log.series, touched))
    clear = {joint: b.bandwidth_hz for joint, b in clean.items() if b.after_nm < 0.93 * b.before_nm}
    assert clear
    assert set(clear) <= set(found)
    # what hardly matters to the residual is either; what matters is noise without contact, too
    assert {joint for joint, b in found.items() if b.after_nm < 0.9 * b.before_nm} <= set(clean)
    assert [found[j].bandwidth_hz for j in clear] == pytest.approx(list(clear.values()), rel=0.5)


def test_a_band_that_is_motion_where_moves_begin_and_end_is_kept(made: Maker) -> None:
    """Bursts of 15 Hz in a tenth of the time, and noise in the model's torque all the way."""
    log = prepared_of(made("free-clean", "paper6", duration_s=20.0))
    t = log.series.time_s
    bursts = np.where(t % 3.0 < 0.3, 1.6 * np.sin(2.0 * np.pi * 15.0 * t), 0.0)[:, None] * np.ones(6)
    model = np.asarray(bursts + 0.3 * np.random.default_rng(1).standard_normal(bursts.shape))
    assert not quiet_model(replace(log.series, effort=bursts), model, None)[1]


@pytest.mark.parametrize(("share", "noise"), [(-0.3, True), (0.3, True), (-0.8, False), (0.8, False)])
def test_a_band_nearer_to_none_than_to_one_is_noise_whatever_its_sign(made: Maker, share: float, noise: bool) -> None:
    """An effort that holds so much of what the model's torque has in its upper bands."""
    log = prepared_of(made("free-clean", "paper6", duration_s=20.0))
    assert log.rigid_nm is not None
    drawn = 3.0 * np.random.default_rng(0).standard_normal(log.rigid_nm.shape)
    effort, model = np.asarray(log.rigid_nm + share * drawn), np.asarray(log.rigid_nm + drawn)
    assert bool(quiet_model(replace(log.series, effort=effort), model, None)[1]) is noise


@pytest.mark.parametrize("height", [0.0, 15.0])
def test_what_is_left_out_of_fast_motion_raises_the_threshold(made: Maker, height: float) -> None:
    """A jerk in bands that are noise all the way: the threshold stands above what the model lacks of it, only there."""
    log = prepared_of(made("free-clean", "paper6", duration_s=20.0))
    t = log.series.time_s
    jerk = height * np.exp(-(((t - 10.0) / 0.01) ** 2))
    motion = np.sin(2.0 * np.pi * 0.2 * t) + jerk
    model = np.repeat(motion[:, None], 6, axis=1) + 2.0 * np.random.default_rng(1).standard_normal((t.size, 6))
    effort = np.repeat(motion[:, None], 6, axis=1)
    quiet, found = quiet_model(replace(log.series, effort=effort), model, None)
    assert found
    kernel = direct_kernel(20.0, causal=False)
    for one in found:
        column = [log.series.column(one.joint)]
        passed = (kernel.apply(x[:, column], log.series.segments, log.series.period_s)[:, 0]
                  for x in (effort - quiet, effort - model, model - quiet))  # fmt: skip
        wrong, noise, left_out = map(np.abs, passed)
        lacking, near = one.lacking_nm(kernel, log.series), np.abs(t - 10.0) < 0.5
        bound = noise.max() + 4.0 * np.sqrt(np.mean(left_out[~near] ** 2))
        assert np.count_nonzero(lacking[~near]) < 0.002 * t.size
        assert (wrong[near].max() > 1.2 * bound) == (height > 0.0)
        assert np.all(wrong[near] < lacking[near] + bound)


def test_the_residual_carries_what_the_model_lacks(made: Maker, friction_of: Fitted) -> None:
    """Offline, and not causally: then effort and motion pass the same filter."""
    files = made("free-clean", "paper6", duration_s=20.0, imperfections=("slow-currents",))
    log, settings = prepared_of(files), load_config(files.config)
    assert log.quiet
    jerk = 20.0 * (np.abs(log.series.time_s - 10.0) < 0.02)
    log = replace(log, quiet=tuple(replace(one, left_out_nm=one.left_out_nm + jerk) for one in log.quiet))
    laws, _ = friction_models(friction_of("paper6").joints, log.judged_series)
    inputs = ResidualInputs(laws, frozenset())
    for causal in (False, True):
        detect = settings.config.detect.changed({"causal": causal})
        found, without = (
            detector_named("direct").residual(each, inputs, detect) for each in (log, replace(log, quiet=()))
        )
        for one in log.quiet:
            j = log.judged_series.joint_names.index(one.joint)
            more = found.uncertainty_nm[:, j] - without.uncertainty_nm[:, j]
            expected = 0.0 if causal else one.lacking_nm(found.balance.kernel, log.series)
            np.testing.assert_allclose(more, expected, atol=1e-9)
            assert causal or more.max() > 3.0
