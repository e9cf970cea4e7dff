"""--from and --to: a part is judged as if the rest were absent, on the clock of the whole log, and is said."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from synthetic import PERIOD, make_log

from collaudit.core.errors import LogError
from collaudit.core.logs.log_reading import part_of_log


def test_a_part_keeps_the_clock_of_the_log_and_is_said() -> None:
    time_s = PERIOD * np.arange(1000)
    q = np.sin(time_s)[:, None]
    log = make_log(time_s, q, q, q, ("joint1",))
    part = part_of_log(log, 0.5, 1.0)
    assert part.time_s[0] == pytest.approx(0.5) and part.time_s[-1] < 1.0
    assert np.array_equal(part.position_rad, q[(time_s >= 0.5) & (time_s < 1.0)])
    assert [finding.code for finding in part.findings] == ["part-of-log"]
    assert part_of_log(log, None, None) is log
    assert part_of_log(log, 1.0, None).time_s[-1] == time_s[-1]
    with pytest.raises(LogError, match="no sample there"):
        part_of_log(log, 1e4, None)


def test_a_contact_counts_only_in_the_part_that_is_judged(arm, collaudit, tmp_path: Path) -> None:
    judge = ("detect", arm.pushed, "-c", arm.config, "--friction", arm.friction, "-o", tmp_path / "run")

    def contacts(*flags: object) -> tuple[int, dict]:
        done = collaudit(*judge, *flags)
        assert done.code in (0, 1, 3), done.err
        return done.code, json.loads((tmp_path / "run" / "audit.json").read_text())

    code, whole = contacts()
    at = whole["contacts"][0]["onset_s"]
    assert code == 1
    code, part = contacts("--from", at - 4.0)
    assert code == 1 and part["contacts"][0]["onset_s"] == pytest.approx(at, abs=0.02)
    assert any("were read, as asked for" in text for text in part["exclusions"])
    code, before = contacts("--to", at - 1.0)
    assert code != 1 and before["contacts"] == []
    assert collaudit(*judge, "--from", 1e5).code == 3
