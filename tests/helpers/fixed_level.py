"""Friction as it was calibrated: what the residual would be if its level were not followed."""

from __future__ import annotations

import numpy as np
import pytest

from collaudit.core.numeric.arrays import BoolArray, FloatArray
from collaudit.core.residual import residual
from collaudit.core.residual.followed_offsets import FrictionLevel


def fixed_level(
    excess: FloatArray, _friction: FloatArray, _usable: BoolArray, _period_s: float, prior_sd: float, _causal: bool
) -> FrictionLevel:
    """The calibration with its stated uncertainty, in place of ``follow_level``."""
    return FrictionLevel(np.broadcast_to(0.0, excess.size), np.broadcast_to(prior_sd, excess.size))


def with_fixed_level(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge by friction as calibrated from now on."""
    monkeypatch.setattr(residual, "follow_level", fixed_level)
