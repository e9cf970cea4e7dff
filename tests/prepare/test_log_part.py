"""Stretches of a prepared log, as a log of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from collaudit.core.api import load_robot, open_log
from collaudit.core.config import load_config
from collaudit.core.errors import ConfigError, LogError
from collaudit.core.logs.log_reading import part_of_log
from collaudit.core.numeric.arrays import Span
from collaudit.core.prepare.preparation import prepare
from collaudit.fixtures.simulation import SimulatedFiles

Made = Callable[..., SimulatedFiles]


def test_spans_become_stretches_of_one_log(made: Made) -> None:
    """... and a gap of the whole log stays one."""
    files = made("free-clean", "paper6", duration_s=20.0)
    settings = load_config(files.config)
    log = open_log(files.log, settings)
    whole = prepare(log, load_robot(settings, log.joint_names), settings.config)
    n = whole.series.time_s.size
    gap = replace(whole, series=replace(whole.series, segments=(Span(0, 300), Span(340, n))))
    part = gap.part(Span(100, 400), Span(900, 1500))
    rows = np.r_[100:400, 900:1500]
    assert part.series.segments == (Span(0, 200), Span(240, 300), Span(300, 900))
    np.testing.assert_array_equal(part.series.time_s, whole.series.time_s[rows])
    assert part.rigid_nm is not None and whole.rigid_nm is not None
    np.testing.assert_array_equal(part.rigid_nm, whole.rigid_nm[rows])
    assert whole.part(Span(0, n)) is whole


def test_times_in_the_wrong_order_are_a_fault_of_the_settings_and_not_of_the_log(made: Made) -> None:
    files = made("free-clean", "paper6", duration_s=20.0)
    log = open_log(files.log, load_config(files.config))
    with pytest.raises(ConfigError, match="between these times"):
        part_of_log(log, 10.0, 3.0)
    with pytest.raises(LogError, match="no sample there"):
        part_of_log(log, 30.0, 40.0)
