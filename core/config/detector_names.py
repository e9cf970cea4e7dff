"""The detectors by name: the line that a new one adds, beside its file in ``core/residual/detectors``."""

from __future__ import annotations

from typing import Literal, get_args

#: Each name is that of its module in ``core/residual/detectors``.
DetectorName = Literal["direct", "momentum", "filtered", "eso", "energy", "combined"]

DETECTOR_NAMES: tuple[DetectorName, ...] = get_args(DetectorName)
