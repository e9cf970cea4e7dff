"""What is computed for all contacts of a log together, against the same for one sample and over all samples."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from collaudit.core.contacts.contact_scene import ArmAtSamples
from collaudit.core.contacts.external_force import Unsmoothed
from collaudit.core.data.signals import State
from collaudit.core.detection.detector_run import DetectorRun
from collaudit.fixtures.arms import robot_named


def test_lever_arms_of_all_samples_are_those_of_each() -> None:
    robot = robot_named("paper6").model()
    q = np.random.default_rng(5).uniform(-2.0, 2.0, (6, 6))
    q[2, 4] = np.nan
    log = SimpleNamespace(
        robot=robot, judged=robot.joint_names, phases=np.zeros(6), series=SimpleNamespace(position_rad=q)
    )
    at = ArmAtSamples(log, [5, 2, 0, 5])  # type: ignore[arg-type]
    assert [at.position_known(k) for k in (5, 2, 0, 1)] == [True, False, True, False]
    unit = np.hstack([np.eye(3), np.zeros((3, 3))])
    assert len(at.link_frames) >= 6
    for frame in at.link_frames:
        for k in (5, 0):
            alone = robot.wrench_torque(np.repeat(q[k][None, :], 3, axis=0), unit, frame)
            assert np.array_equal(at.lever_arms(frame, k), alone)
            assert np.array_equal(at.rotation(frame, k), robot.frame_rotation(q[k], frame))


def test_residuals_before_the_kernel_and_their_noise_are_those_of_all_samples_at_once() -> None:
    rng = np.random.default_rng(6)
    n, order = 17_000, [2, 0]
    effort, rigid, contact = (np.asfortranarray(rng.normal(size=(n, 3))) for _ in range(3))
    smoothed, total = (np.asfortranarray(rng.normal(size=(n, 2))) for _ in range(2))
    effort[:40, 2] = effort[9_000, 0] = np.nan
    state = np.where(rng.random((n, 2)) < 0.8, State.JUDGED, State.EDGE).astype(np.int8)
    series = SimpleNamespace(time_s=0.002 * np.arange(n), period_s=0.002, effort=effort)
    log = SimpleNamespace(series=series, rigid_nm=rigid, contact_nm=contact, columns=lambda: order)
    residual = SimpleNamespace(torque_nm=smoothed, balance=SimpleNamespace(total_nm=total))
    run = DetectorRun(None, residual, np.full((n, 2), 3.0, np.float32), SimpleNamespace(state=state))  # type: ignore[arg-type]
    samples = [3, 9_002, n - 1]
    known = Unsmoothed.of(log, run, samples)  # type: ignore[arg-type]
    plain = (effort - rigid - contact)[:, order] + smoothed - total
    noise = [np.nanmedian(np.abs(plain[state[:, j] == State.JUDGED, j])) * 1.4826 for j in range(2)]
    assert np.array_equal(known.noise_nm, noise)
    for k in samples[1:]:
        np.testing.assert_allclose(known.torque_nm(k), np.nanmean(plain[k - 5 : k + 6], axis=0), rtol=1e-12)
    assert np.isnan(known.torque_nm(3)[0])
    assert np.isfinite(known.torque_nm(3)[1])
