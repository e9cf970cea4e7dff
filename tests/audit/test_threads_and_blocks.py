"""An audit gives the same bytes whatever the number of threads, and however long the blocks that they work on."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.numeric import blocks
from collaudit.core.numeric.parallel import threads, use_threads
from collaudit.fixtures.simulated_audit import audit_simulated
from collaudit.fixtures.simulation import SimulatedFiles
from collaudit.reports.files.run_files import audit_json


@pytest.mark.parametrize(("count", "samples"), [(1, 700), (2, 5000), (2, 1 << 20)])
def test_results_do_not_depend_on_threads_and_blocks(
    made: Callable[..., SimulatedFiles],
    friction_of: Callable[[str], FrictionFile],
    count: int,
    samples: int,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    files, friction, before = made("free-hits", "seven"), friction_of("seven"), threads()
    usual = audit_simulated(files, friction)
    monkeypatch.setattr(blocks, "SAMPLES", samples)
    monkeypatch.setattr(blocks, "_OF_SEVERAL", samples)
    use_threads(count)
    try:
        other = audit_simulated(files, friction)
    finally:
        use_threads(before)
    assert usual.result.collisions
    assert audit_json(other.result) == audit_json(usual.result)
    assert other.signals.residual_nm.tobytes("F") == usual.signals.residual_nm.tobytes("F")
