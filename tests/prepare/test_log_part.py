"""Stretches of a prepared log, as a log of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from collaudit.core.api import load_robot, open_log
from collaudit.core.config import load_config
from collaudit.core.numeric.arrays import Span
from collaudit.core.numeric.filters import low_pass
from collaudit.core.prepare.preparation import KnownLoad, loaded, prepare, recalibrated
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


def test_a_thinned_log_is_calibrated_from_the_same_samples(made: Made) -> None:
    """... with an effort that was filtered before, and a known load that goes with them; a part's load does, too."""
    files = made("free-clean", "paper6", duration_s=20.0)
    settings = load_config(files.config, {"detect.detector": "direct"})
    log = open_log(files.log, settings)
    plain = prepare(log, load_robot(settings, log.joint_names), settings.config)
    whole = loaded(plain, KnownLoad(2.0), settings.config)
    few, n = whole.thinned(12), whole.series.time_s.size
    made_again = recalibrated(few, few.calibration, settings.config)
    assert whole.start.load_nm is not None and few.start.load_nm is not None and whole.series.effort is not None
    np.testing.assert_array_equal(few.start.load_nm, whole.start.load_nm[::12])
    filters = whole.series.segments, whole.series.period_s, whole.series.bandwidth_hz
    assert made_again.series.effort is not None
    np.testing.assert_array_equal(made_again.series.effort, low_pass(whole.series.effort, *filters)[::12])
    assert few.series.segments == (Span(0, -(-n // 12)),)
    assert few.series.period_s == 12 * whole.series.period_s
    part = whole.part(Span(100, 400))
    assert part.start.load_nm is not None
    np.testing.assert_array_equal(part.start.load_nm, whole.start.load_nm[100:400])
