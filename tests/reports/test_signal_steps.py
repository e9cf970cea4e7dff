"""Signals are stored in steps that lose nothing a threshold depends on."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import samples
from hypothesis import given
from hypothesis import strategies as st

from collaudit.core.data.signals import State
from collaudit.reports.files.run_files import open_run, read_run, write_run
from collaudit.reports.plots.joint_trace import in_steps, in_steps_within, torque_step_nm

GAMMA = 4.0
LIMIT = np.full(9, GAMMA, np.float32)


@pytest.fixture
def noise() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.random.default_rng(6).normal(0.0, 0.1, 5000)


def test_a_step_is_below_a_thousandth_of_gamma_and_far_below_the_noise(
    noise: np.ndarray[tuple[int], np.dtype[np.float64]],
) -> None:
    assert torque_step_nm(noise, LIMIT) == 2.0**-8
    quiet = torque_step_nm(0.001 * noise, LIMIT)
    assert 0.0 < quiet <= 0.0001 / 16 < 4.1 * quiet
    assert torque_step_nm(noise, np.nan * LIMIT) == torque_step_nm(np.zeros(9), LIMIT) == 0.0
    assert torque_step_nm(np.full(9, np.nan), LIMIT) == torque_step_nm(np.empty(0), LIMIT) == 0.0


@given(
    st.lists(st.floats(-1e3, 1e3), min_size=1, max_size=20),
    st.floats(1e-3, 100.0),
    st.sampled_from([0.0, 2.0**-8, 2.0**-3, 2.0**-20]),
)
def test_no_value_crosses_the_threshold(values: list[float], gamma: float, step: float) -> None:
    around = [gamma, np.nextafter(gamma, 0.0), np.nextafter(gamma, np.inf), gamma + step / 2, gamma - step / 2]
    x = np.array([*values, *around, *(-np.array(around)), np.nan])
    limits = [np.full(x.size, level, np.float32) for level in (gamma, 0.8 * gamma)]
    stored = in_steps_within(x, step, limits).astype(np.float64)
    for limit in limits:
        np.testing.assert_array_equal(np.abs(stored) > limit, np.abs(x) > limit)
    np.testing.assert_allclose(stored, x, rtol=2e-7, atol=step + 1e-30)
    plain = in_steps(x, step)
    if step:
        assert np.all(plain[:-1] / step == np.round(plain[:-1].astype(float) / step))


@pytest.mark.parametrize("rows", [300, 999, 1000])
def test_parts_that_are_written_one_after_the_other_do_not_mix(
    tmp_path: Path, rows: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    audit = samples.failed(2000)
    wrench = np.random.default_rng(3).normal(0.0, 5.0, (2000, 6))
    audit = replace(audit, signals=replace(audit.signals, wrench=wrench))
    write_run(tmp_path / "whole", audit, None)
    monkeypatch.setattr("collaudit.reports.files.signals_file._ROWS", rows)
    write_run(tmp_path / "parts", audit, None)
    whole, parts = (pq.read_table(tmp_path / name / "signals.parquet") for name in ("whole", "parts"))
    assert whole.column_names == parts.column_names
    for name in whole.column_names:
        np.testing.assert_array_equal(parts[name].to_numpy(), whole[name].to_numpy(), err_msg=name)


def test_the_file_states_its_steps_and_keeps_to_them(
    tmp_path: Path, noise: np.ndarray[tuple[int], np.dtype[np.float64]]
) -> None:
    audit = samples.failed(5000)
    shape = audit.signals.residual_nm.shape
    residual = np.array(np.broadcast_to(noise[:, None], shape))
    residual[7] = GAMMA + 1e-9
    gamma = np.full(shape, GAMMA, np.float32)
    signals = replace(audit.signals, residual_nm=residual, gamma_nm=gamma, wrench=np.full((5000, 6), 0.12345))
    write_run(tmp_path, replace(audit, signals=signals), None)
    meta = json.loads(pq.read_schema(tmp_path / "signals.parquet").metadata[b"collaudit"])
    assert meta["torque_step_nm"] == [2.0**-8] * shape[1]
    back = read_run(tmp_path).signals
    np.testing.assert_array_equal(back.residual_nm > GAMMA, residual > GAMMA)
    assert 0.0 < np.abs(back.residual_nm - residual).max() <= 2.0**-8
    assert np.nanmax(np.abs(back.position_rad - signals.position_rad)) <= meta["position_step"] / 2 + 1e-7
    assert np.nanmax(np.abs(back.velocity_rad_s - signals.velocity_rad_s)) <= meta["velocity_step"] / 2 + 1e-7
    assert back.wrench is not None
    assert (np.abs(back.wrench - 0.12345).max(axis=0) <= [2**-8] * 3 + [2**-10] * 3).all()
    trace = open_run(tmp_path).signals.trace(0)
    np.testing.assert_array_equal(trace.residual_nm, back.residual_nm[:, 0])
    assert trace.residual_nm.dtype == np.float64
    assert (back.state == State(0)).any()
