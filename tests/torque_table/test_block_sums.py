"""Slopes from sums over blocks of time: against statsmodels, with known truth, and where some blocks are contact."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t as student
from statsmodels.regression.linear_model import OLS

from collaudit.core.torque_table.block_sums import BlockSums, estimate, rows_of_blocks

NAMES = ("effort", "model", "way", "speed")
BLOCKS, EACH = 30, 40


def columns(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Half a minute of a joint with gravity and friction, errors alike within a second; blocks and columns."""
    rng = np.random.default_rng(seed)
    t = np.arange(BLOCKS * EACH) / EACH
    q, v = 0.8 * np.sin(0.9 * t) + 0.3 * np.sin(2.3 * t), 0.72 * np.cos(0.9 * t) + 0.69 * np.cos(2.3 * t)
    model = 10.0 * np.cos(q + 0.5)
    effort = 1.1 * model + 2.0 * np.sign(v) + v + np.repeat(rng.normal(0.0, 1.0, BLOCKS), EACH)
    return np.floor(t), np.column_stack([effort, model, np.sign(v), v])


def test_slope_is_that_of_least_squares_and_its_interval_that_of_a_jackknife_where_no_block_is_far_off() -> None:
    """Leaving out each block in turn, with Student's t of as many blocks as tell the slope."""
    block, found = columns(0)
    found[:, 0] += np.random.default_rng(1).normal(0.0, 0.1, block.size) - np.repeat(
        np.random.default_rng(0).normal(0.0, 1.0, BLOCKS), EACH
    )
    slope = BlockSums.of(block, NAMES, found).slope("effort", "model", "way", "speed", "one")
    assert slope is not None
    design = np.column_stack([found[:, 1:], np.ones(block.size)])
    value = OLS(found[:, 0], design).fit().params[0]
    own = OLS(design[:, 0], design[:, 1:]).fit().resid ** 2
    share = np.bincount(block.astype(int), own) / own.sum()
    without = [OLS(found[block != k, 0], design[block != k]).fit().params[0] for k in range(BLOCKS)]
    error = float(np.sqrt(np.sum((np.array(without) - value) ** 2)))
    assert slope.value == pytest.approx(value, rel=1e-9)
    assert slope.half == pytest.approx(student.ppf(0.975, 1.0 / np.sum(share**2) - 1.0) * error, rel=0.07)


def test_the_interval_covers_the_slope() -> None:
    slopes = [BlockSums.of(*named(seed)).slope("effort", "model", "way", "speed", "one") for seed in range(200)]
    hits = sum(abs(slope.value - 1.1) <= slope.half for slope in slopes if slope is not None)
    assert hits >= 0.87 * 200


def named(seed: int) -> tuple[np.ndarray, tuple[str, ...], np.ndarray]:
    block, found = columns(seed)
    return block, NAMES, found


@pytest.mark.parametrize("share", [0.1, 0.3])
def test_contact_in_some_blocks_moves_the_slope_by_less_than_its_error(share: float) -> None:
    block, found = columns(3)
    clean = BlockSums.of(block, NAMES, found).slope("effort", "model", "way", "speed", "one")
    touched = np.random.default_rng(4).permutation(BLOCKS)[: round(share * BLOCKS)]
    found[:, 0] += np.where(np.isin(block, touched), -40.0 * np.sign(found[:, 1]), 0.0)
    pushed = BlockSums.of(block, NAMES, found).slope("effort", "model", "way", "speed", "one")
    assert clean is not None and pushed is not None
    assert pushed.value == pytest.approx(clean.value, abs=2.0 * clean.half)


def test_a_log_less_some_blocks_is_its_sums_less_theirs() -> None:
    block, found = columns(5)
    sums, kept = BlockSums.of(block, NAMES, found), block % 3 != 0
    part = BlockSums.of(block[kept], NAMES, found[kept])
    left = np.arange(BLOCKS) % 3 != 0
    np.testing.assert_allclose(sums.products[left], part.products)
    assert sums.count[left].tolist() == part.count.tolist()


def test_what_is_another_column_s_is_not_told() -> None:
    block, found = columns(6)
    found[:, 1] = 3.0 * found[:, 2] + 2.0
    assert BlockSums.of(block, NAMES, found).slope("effort", "model", "way", "speed", "one") is None


def test_coefficients_that_joints_share_are_told_by_all_of_them_and_held_by_the_prior() -> None:
    rng = np.random.default_rng(7)
    rows = rng.normal(size=(2, 600, 2))
    truth = np.array([1.5, -0.5, 4.0])  # one that both joints share, and each joint's own
    torque = [rows[j] @ truth[[0, 1 + j]] + rng.normal(0.0, 0.1, 600) for j in range(2)]
    every = np.stack([np.column_stack([rows[j], torque[j]]) for j in range(2)], axis=1)
    of_block = rows_of_blocks(every, np.arange(600) // 20)
    products = of_block.transpose(0, 2, 3, 1) @ of_block.transpose(0, 2, 1, 3)
    count, place = np.full((30, 2), 20.0), np.array([[0, 1], [0, 2]])
    found = estimate(products, count, place, np.zeros(3))
    np.testing.assert_allclose(found.value, truth, atol=4.0 * np.sqrt(np.diag(found.covariance)).max())
    held = estimate(products, count, place, np.array([0.0, 1e9, 0.0]))
    assert abs(held.value[1]) < 1e-5


def test_without_blocks_the_prior_alone_tells() -> None:
    """A half of a log in which nothing was measured."""
    found = estimate(np.zeros((0, 2, 3, 3)), np.zeros((0, 2)), np.array([[0, 1], [0, 2]]), np.ones(3), usual=1.0)
    assert found.value.tolist() == [0.0, 0.0, 0.0] and found.count == found.left == 0.0
