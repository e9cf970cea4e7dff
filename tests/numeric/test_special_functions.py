"""Special functions without their package: the digits of SciPy, and SciPy itself where they do not load alone."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator

import pytest
from scipy import special

from collaudit.core.numeric import special_functions as ours

ALONE = """
import sys
from collaudit.core.numeric import special_functions as ours
found = [ours.student_quantile(3.5, 0.975), ours.gamma_quantile(4.0, 0.05), ours.fisher_tail(2.0, 9.0, 3.3)]
assert "scipy.special" not in sys.modules
from scipy import special, stats
assert found == [special.stdtrit(3.5, 0.975), special.gammaincinv(4.0, 0.05), special.fdtrc(2.0, 9.0, 3.3)]
assert ours.student_share(4.0, 1.0) == stats.t.cdf(1.0, 4.0)
"""


@pytest.fixture(params=["alone", "package"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[str]:
    if request.param == "package":
        monkeypatch.setattr(ours, "_PARTS", ("_no_such_part",))
    ours._functions.cache_clear()
    yield request.param
    ours._functions.cache_clear()


def test_they_are_those_of_scipy(way: str) -> None:
    assert ours.student_quantile(3.5, 0.975) == special.stdtrit(3.5, 0.975)
    assert ours.student_share(4.0, -1.2) == special.stdtr(4.0, -1.2)
    assert ours.fisher_tail(2.0, 9.0, 3.3) == special.fdtrc(2.0, 9.0, 3.3)
    assert ours.fisher_quantile(2.0, 9.0, 0.95) == special.fdtri(2.0, 9.0, 0.95)
    assert ours.gamma_quantile(4.0, 0.05) == special.gammaincinv(4.0, 0.05)
    assert ours.binomial_quantile(0.025, 40, 0.3) == special.bdtrik(0.025, 40, 0.3)
    assert ours.binomial_tail(3, 40, 0.3) == special.bdtrc(3, 40, 0.3)


def test_the_package_is_not_imported_and_may_be_later() -> None:
    subprocess.run([sys.executable, "-c", ALONE], check=True)
