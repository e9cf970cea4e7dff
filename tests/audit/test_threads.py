"""An audit gives the same bytes whatever the number of threads."""

from __future__ import annotations

from collections.abc import Callable

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.numeric.parallel import threads, use_threads
from collaudit.fixtures.compare import audit_simulated
from collaudit.fixtures.simulation import SimulatedFiles
from collaudit.reports.files.run_files import result_json


def test_results_do_not_depend_on_threads(
    made: Callable[..., SimulatedFiles],
    friction_of: Callable[[str], FrictionFile],
) -> None:
    files, friction, before = made("free-hits", "seven"), friction_of("seven"), threads()
    usual = audit_simulated(files, friction)
    use_threads(1 if before > 1 else 2)
    try:
        other = audit_simulated(files, friction)
    finally:
        use_threads(before)
    assert usual.result.collisions
    assert result_json(other.result) == result_json(usual.result)
    assert other.signals.residual_nm.tobytes("F") == usual.signals.residual_nm.tobytes("F")
