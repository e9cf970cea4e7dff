"""A detector: one way to compute a residual from a prepared log; and the registry of them.

A new detector is one file in ``core/residual/detectors``, which ends in ``DETECTOR = Detector(...)``, and its name,
which is the file's, in ``core/config/detector_names.py``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module

from collaudit.core.config.detector_names import DETECTOR_NAMES
from collaudit.core.config.schema import DetectConfig
from collaudit.core.errors import ConfigError
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.residual import Residual, ResidualInputs


@dataclass(frozen=True, slots=True)
class Detector:
    """One way to estimate external joint torque.

    Attributes:
        name: as in ``[detect] detector``.
        equation: what it computes.
        source: where it comes from.
        residual: of a prepared log, with the friction laws at hand and ``[detect]``.
        by_joint: each joint has a residual with a sign; noise does not cancel in the mean of a norm.
    """

    name: str
    equation: str
    source: str
    residual: Callable[[Prepared, ResidualInputs, DetectConfig], Residual]
    by_joint: bool = True


def detector_named(name: str) -> Detector:
    """The detector of that name; its module is imported when it is first asked for.

    Raises:
        ConfigError: there is none.
    """
    if name not in DETECTOR_NAMES:
        raise ConfigError("there is no such detector", found=name, expected=", ".join(DETECTOR_NAMES))
    detector: Detector = import_module(f"collaudit.core.residual.detectors.{name}").DETECTOR
    return detector
