"""Points without each fold in turn, made in one pass over a joint, against those of the log with that fold masked."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.api import prepare
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.data.uniform_series import MOVING_RAD_S
from collaudit.core.friction.friction_points import friction_points
from collaudit.core.friction.held_out_laws import _FoldedLog, fold_of_sample
from collaudit.core.friction.motion_points import motion_points, motion_samples
from collaudit.core.friction.sections import find_sections
from collaudit.core.prepare.prepared import Prepared
from collaudit.fixtures.simulation import Reduction, SimulatedFiles

Maker = Callable[..., SimulatedFiles]


def masked(log: Prepared, fold: int, folds: int) -> Prepared:
    """The log with one fold marked as effort that must not be used."""
    out = fold_of_sample(log.series, folds) == fold
    return replace(log, series=replace(log.series, saturated=log.series.saturated | out[:, None]))


@pytest.mark.parametrize("motion", ["sections", "any"])
def test_points_without_a_fold(made: Maker, friction: FrictionFile, motion: str) -> None:
    files = made("friction", "paper6", reduction=Reduction(speeds=10))
    loaded = load_config(files.config)
    log, config = prepare(files.log, loaded), loaded.config
    joint = "joint2"
    fit: FrictionFit = replace(friction.joints[joint], motion=motion)
    found = _FoldedLog.of(log, [fit], config).points(joint, fit, config)
    assert len(found) == config.fit.blocks
    for k, points in enumerate(found):
        rest = masked(log, k, config.fit.blocks)
        if motion == "any":
            plain = motion_points(rest, joint)
        else:
            sections = find_sections(rest.series, config.sections).of(joint)
            plain = friction_points(rest.series, sections, rest.rigid_nm, config.friction)
        assert plain and list(points) == list(plain)
    assert found[0] != found[1]


def test_points_of_motion_bin_by_bin(hits: Path) -> None:
    log = prepare((hits,), load_config(hits.with_suffix(".toml")))
    samples = motion_samples(log, "joint2")
    assert samples is not None
    speed = samples.speed
    edges = np.geomspace(max(MOVING_RAD_S, float(np.quantile(speed, 0.02))), float(speed.max()) * 1.0001, 15)
    plain = []
    for sign in (1, -1):
        for low, high in pairwise(edges):
            inside = (speed >= low) & (speed < high) & (samples.direction == sign)
            ids, label = np.unique(samples.stretch[inside], return_inverse=True)
            if ids.size >= 4:
                values = samples.friction[inside]
                mean, count = float(values.mean()), np.bincount(label)
                score = np.bincount(label, weights=values) - mean * count
                se = float(np.sqrt(ids.size / (ids.size - 1) * np.sum(score**2))) / values.size
                plain.append((sign, float(speed[inside].mean()), mean, se))
    found = [(p.direction, p.speed_rad_s, p.friction_nm, p.se_nm) for p in motion_points(log, "joint2")]
    assert len(found) > 10 and found == plain
