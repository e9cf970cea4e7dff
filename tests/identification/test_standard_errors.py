"""Standard errors of an identification against cluster-robust ones of statsmodels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import t
from statsmodels.regression.linear_model import OLS

from collaudit.core.identification.problem.identification_problem import solve
from collaudit.core.identification.problem.identification_samples import Motion
from collaudit.core.identification.problem.problem_terms import Terms, Unknowns, friction_columns
from collaudit.core.identification.problem.solution_errors import standard_errors
from collaudit.core.numeric.stats import NORMAL_QUANTILE_975

CLUSTERS, EACH = 12, 60
TRUE = np.array([2.0, -0.7])


def repeated(part: np.ndarray) -> np.ndarray:
    """The same in every cluster: each then brings the same share of what is known."""
    return np.concatenate([part] * CLUSTERS)


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
    count = cluster.size
    zeros = np.zeros((count, 1))
    motion = Motion(
        position=zeros,
        velocity=velocity[:, None],
        acceleration=acceleration[:, None],
        effort=effort[:, None],
        contact=zeros,
        moving=np.ones((count, 1), dtype=bool),
        drift=np.zeros((count, 0)),
        coupled=np.zeros((0, 1)),
        load=zeros,
        log=np.zeros(count, dtype=np.intp),
        row=np.arange(count),
        bandwidth_hz=20.0,
        regressor=columns[:, None, :],
        cluster=cluster,
        block=cluster % 5,
        rate_hz=60.0,
        loss="",
    )
    held = np.zeros(1)
    unknowns = Unknowns(np.zeros(2), np.full(2, 1e6), held, held, np.ones(1), held)
    terms = Terms.of(motion, unknowns)
    solution = solve(terms, unknowns)
    found = standard_errors(terms, solution, unknowns)

    design = np.column_stack([columns, friction_columns(velocity, acceleration)])
    fit = OLS(effort, design).fit(cov_type="cluster", cov_kwds={"groups": cluster, "use_correction": False})
    np.testing.assert_allclose(solution.inertials, fit.params[:2], rtol=1e-6)
    factor = t.ppf(0.975, CLUSTERS - 1) / NORMAL_QUANTILE_975 / (1.0 - 1.0 / CLUSTERS)
    np.testing.assert_allclose(np.sqrt(np.diag(found.covariance)), factor * fit.bse[:2], rtol=1e-6)
    np.testing.assert_allclose(found.covariance, factor**2 * fit.cov_params()[:2, :2], rtol=1e-5, atol=1e-12)
    assert found.offset_sd[0] == pytest.approx(factor * fit.bse[4], rel=1e-6)
    assert found.offset_sd[0] > 1.5 * OLS(effort, design).fit().bse[4]  # errors alike in a cluster do count
    np.testing.assert_allclose(found.moved(np.arange(2)), found.covariance, rtol=1e-6)
    # told alone it takes the other's error along, as it would in these very samples
    beside = np.delete(design, 1, axis=1)
    taken = np.linalg.lstsq(beside, columns[:, 1], rcond=None)[0][0]
    (a, c), (_, b) = found.covariance
    assert found.moved(np.array([0]))[0, 0] == pytest.approx(a + 2 * taken * c + taken**2 * b, rel=1e-3)
