"""Standard errors of an identification against cluster-robust ones of statsmodels."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import t
from statsmodels.regression.linear_model import OLS

from collaudit.core.identification.motion_sums import MotionSums
from collaudit.core.identification.sums_solution import Problem, Unknowns
from collaudit.core.identification.torque_terms import friction_columns
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975
from collaudit.core.torque_table.block_sums import products_of

CLUSTERS, EACH = 12, 60
TRUE = np.array([2.0, -0.7])


def repeated(part: np.ndarray) -> np.ndarray:
    """The same in every cluster: each then brings the same share of what is known."""
    return np.concatenate([part] * CLUSTERS)


def sums_of(*signals: np.ndarray) -> MotionSums:
    """One joint's, with two inertial parameters; its blocks are the clusters."""
    inertial, velocity, acceleration, effort, cluster = signals
    one, law = np.ones(cluster.size), friction_columns(velocity, acceleration)
    parts = (one, effort, 0.0 * one, acceleration, np.zeros((one.size, 2)), inertial, law)
    raw = products_of(np.column_stack(parts)[:, None], cluster)
    first = {"one": 0, "effort": 1, "model": 2, "spin": 3, "load": 4, "base": 6, "law": 8}
    body: Any = SimpleNamespace(joint_names=("joint1",))
    robot: Any = SimpleNamespace(
        joint_names=("joint1",), inertial_parameters=np.zeros(2), armature=np.zeros(1), inertial_bodies=lambda: body
    )
    each = np.arange(CLUSTERS)
    ends = dict.fromkeys(("axes", "angle", "drift", "end"), 15)
    return MotionSums(
        robot, {**first, **ends}, np.eye(2), raw, raw[:, :, 0, 0], each % 5, 0 * each, EACH * each,
        EACH * each + EACH - 1, 1.0 / EACH, np.array([False]), (None,), np.zeros((0, 1)), np.zeros((0, 2)), one.size,
        60.0, "",
    )  # fmt: skip


def nothing_known() -> Unknowns:
    """Next to no prior of the inertials; rotor and gain are held."""
    held = np.zeros(1)
    return Unknowns(np.zeros(2), np.full(2, 1e6), held, held, np.ones(1), held)


def test_they_are_cluster_robust_with_the_stated_factors() -> None:
    """Without outliers and prior, clusters alike: Liang and Zeger's, raised by 1/(1 - 1/c) and Student's t of c - 1."""
    rng = np.random.default_rng(3)
    columns = repeated(rng.normal(size=(EACH, 2)))
    velocity = repeated(rng.choice([-1.0, 1.0], EACH) * rng.uniform(0.03, 1.0, EACH))
    acceleration = repeated(rng.normal(size=EACH))
    cluster = np.repeat(np.arange(CLUSTERS), EACH)
    # errors of one size, so that no weight is below one; of like sign inside a cluster more often than not
    bias = rng.uniform(-0.6, 0.6, CLUSTERS)[cluster]
    effort = columns @ TRUE + 3.0 * np.sign(velocity) + np.where(rng.uniform(-1, 1, cluster.size) < bias, 0.1, -0.1)
    problem = Problem.of(sums_of(columns, velocity, acceleration, effort, cluster), nothing_known())
    solution = problem.solved()
    found = problem.errors(solution)

    design = np.column_stack([columns, friction_columns(velocity, acceleration)])
    fit = OLS(effort, design).fit(cov_type="cluster", cov_kwds={"groups": cluster, "use_correction": False})
    np.testing.assert_allclose(solution.inertials, fit.params[:2], rtol=1e-6)
    factor = t.ppf(0.975, CLUSTERS - 1) / NORMAL_QUANTILE_975 / (1.0 - 1.0 / CLUSTERS)
    np.testing.assert_allclose(np.sqrt(np.diag(found.inertials)), factor * fit.bse[:2], rtol=1e-6)
    np.testing.assert_allclose(found.inertials, factor**2 * fit.cov_params()[:2, :2], rtol=1e-5, atol=1e-12)
    assert found.offset_sd[0] == pytest.approx(factor * fit.bse[4], rel=1e-6)
    np.testing.assert_allclose(problem.errors(solution, slice(2)).load, found.inertials, rtol=1e-6)
    # told alone it takes the other's error along, as it would in these very samples
    beside = np.delete(design, 1, axis=1)
    taken = np.linalg.lstsq(beside, columns[:, 1], rcond=None)[0][0]
    (a, c), (_, b) = found.inertials
    load = problem.errors(solution, slice(1)).load
    assert load[0, 0] == pytest.approx(a + 2 * taken * c + taken**2 * b, rel=1e-3)
    assert found.offset_sd[0] > 1.5 * OLS(effort, design).fit().bse[4]  # errors alike in a cluster do count


@pytest.mark.parametrize(("alike", "rows_that_count"), [(False, 1.0), (True, 1.0 / EACH)])
def test_rows_that_err_alike_in_a_block_count_as_one(alike: bool, rows_that_count: float) -> None:
    """Kish's design effect: errors that are the same all through a block leave the weight of one row of it."""
    rng, sd_nm, cluster = np.random.default_rng(5), 0.1, np.repeat(np.arange(CLUSTERS), EACH)
    columns, velocity = rng.normal(size=(cluster.size, 2)), rng.choice([-1.0, 1.0], cluster.size)
    error = rng.choice([-1.0, 1.0], CLUSTERS)[cluster] if alike else rng.choice([-1.0, 1.0], cluster.size)
    effort = columns @ TRUE + 3.0 * velocity + sd_nm * error
    signals = columns, velocity * rng.uniform(0.1, 1.0, cluster.size), rng.normal(size=cluster.size), effort, cluster
    found = Problem.of(sums_of(*signals), nothing_known()).solved()
    assert found.precision[0] * sd_nm**2 == pytest.approx(rows_that_count, rel=0.25)
