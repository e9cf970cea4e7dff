"""The residual by folds in one pass over a joint, against the whole residual once for every fold."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from collaudit.core.api import prepare
from collaudit.core.config import load_config
from collaudit.core.data.audit_result import FrictionFile
from collaudit.core.data.friction_correction import FrictionCorrection, LoadFriction, RippleWave
from collaudit.core.data.friction_result import FrictionFit
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.held_out_laws import fold_of_sample
from collaudit.core.friction.temperature_model import TemperatureModel
from collaudit.core.recommend.held_out_residual import _fold_by_fold, _laws, _of_log, folds_of
from collaudit.core.residual.detector import detector_named

LOAD = LoadFriction(0.05, 0.005, (0.1, 1.0), (20.0, 30.0), (2.0, 60.0))
RIPPLE = RippleWave(16.0, (0.4, 0.1), (0.0, 0.0), 0.05)
WARM = TemperatureModel(-0.01, 0.001, 35.0, 0.02, (32.0, 48.0))
CORRECTED = {
    "joint1": FrictionCorrection(None, (RIPPLE,), 1.0, 0.5),
    "joint2": FrictionCorrection(LOAD, (), 1.0, 0.5),
}


def scaled(fit: FrictionFit, factor: float) -> FrictionModel:
    law = FrictionModel.of(fit)
    assert law is not None
    return replace(law, values={symbol: factor * value for symbol, value in law.values.items()})


@pytest.mark.parametrize(
    "settings",
    [
        {"detect.detector": "direct", "detect.friction_level": "fixed"},
        {"detect.detector": "momentum", "detect.friction_level": "fixed", "detect.causal": True},
        {"detect.detector": "eso", "detect.friction_level": "followed"},
    ],
)
def test_each_fold_is_judged_as_by_the_whole_residual(
    hits: Path, friction: FrictionFile, settings: dict[str, object]
) -> None:
    loaded = load_config(hits.with_suffix(".toml"), {"fit.blocks": 3, **settings})
    log, config = prepare((hits,), loaded), loaded.config
    series = log.series
    saturated = series.saturated.copy()
    saturated[4000:4040, 2] = True
    cut = [replace(series.segments[0], stop=9000), replace(series.segments[0], start=9300)]
    heat = np.tile(np.linspace(30.0, 50.0, series.time_s.size)[:, None], (1, series.position_rad.shape[1]))
    log = replace(log, series=replace(series, saturated=saturated, segments=tuple(cut), temperature_c=heat))
    fits = {joint: fit for joint, fit in friction.joints.items() if joint != "joint6"}
    slower = fits["joint3"].speed_range_rad_s
    assert slower is not None
    fits["joint3"] = replace(fits["joint3"], speed_range_rad_s=(slower[0], 0.5 * slower[1]))  # it runs too fast
    folds = folds_of([log], fits, config)
    law_of = {joint: FrictionModel.of(fit) for joint, fit in fits.items()}
    by_fold = [
        {
            joint: replace(
                law,
                values={s: (1.0 + 0.1 * k) * x for s, x in law.values.items()},
                temperature_model=WARM if joint == "joint4" else None,
            )
            for joint, law in law_of.items()
            if law
        }
        for k in range(3)
    ]
    laws = _laws(log, fits, {}, CORRECTED, replace(folds, laws=by_fold))
    (balance,) = folds.balances
    assert balance is not None and detector_named(config.detect.detector).balance is not None
    found = _of_log(log, laws, balance, config)
    plain = _fold_by_fold(log, laws, fold_of_sample(log.judged_series, 3), frozenset(), config)
    assert np.array_equal(found.torque_nm, plain.torque_nm, equal_nan=True)
    assert np.array_equal(found.evidence, plain.evidence)
    assert np.array_equal(found.judged, plain.judged)
    assert 0.2 < found.judged[:, 0].mean() < found.evidence[:, 0].mean() < 1.0
    assert not found.evidence[:, -1].any()
