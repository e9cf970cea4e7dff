"""The detectors: kernels through which the one residual passes, as data; and one residual of a log judged in parts.

A new detector is a line of ``DETECTORS`` and its name in ``DetectorName`` (``core/config/schema_judging.py``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from collaudit.core.config.schema import DetectConfig
from collaudit.core.data.detection_result import LevelFacts, ZeroFacts
from collaudit.core.errors import ConfigError
from collaudit.core.numeric.arrays import BoolArray
from collaudit.core.numeric.filters import BOTH_WAYS, Kernel, butterworth, double_pole, first_order
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import CausalForm, from_acceleration, from_momentum, torque_balance
from collaudit.core.residual.residual import Residual, ResidualInputs, joint_residuals

#: The kernel G(s) of a detector on a log: its gain, and whether it runs forward only.
KernelOf = Callable[[Prepared, DetectConfig], Kernel]


@dataclass(frozen=True, slots=True)
class Detector:
    """One way to estimate the external torque of each joint.

    Attributes:
        name: as in ``[detect] detector``.
        equation: what it computes.
        source: where it comes from.
        kernel: what both sides of the balance pass.
        causal_form: how torques are balanced before friction where the kernel is causal.
    """

    name: str
    equation: str
    source: str
    kernel: KernelOf
    causal_form: CausalForm

    def residual(self, prepared: Prepared, inputs: ResidualInputs, config: DetectConfig) -> Residual:
        """Of a prepared log, with the friction laws at hand and ``[detect]``."""
        balance = torque_balance(prepared, self.kernel(prepared, config), self.causal_form)
        return joint_residuals(prepared, balance, inputs, config)


def direct_kernel(bandwidth_hz: float, causal: bool) -> Kernel:
    """Unit gain, -3 dB at ``bandwidth_hz``: a Butterworth filter, offline two passes of a double pole."""
    omega = 2.0 * math.pi * bandwidth_hz
    return butterworth(omega, True) if causal else double_pole(omega / BOTH_WAYS, False)


def _as_the_signals(prepared: Prepared, config: DetectConfig) -> Kernel:
    """As narrow as the filter of velocity and acceleration."""
    return direct_kernel(prepared.series.bandwidth_hz, config.causal)


def _observer(kernel_of: Callable[[float, bool], Kernel]) -> KernelOf:
    """That of an observer's gain, 1/s."""
    return lambda prepared, config: kernel_of(config.observer_gain_per_s, config.causal)


DETECTORS = (
    Detector(
        "direct",
        "r = G(s) [tau - tau_s - (M ddq + C dq + f + G)], G as narrow as the filter of dq and ddq",
        "inverse dynamics, both sides filtered alike",
        _as_the_signals,
        from_acceleration,
    ),
    Detector(
        "momentum",
        "r = K [p - ∫(tau - tau_s - f + C^T dq - G - r) dt], so r = K/(s + K) tau_e",
        "generalized-momentum observer (De Luca and Mattone 2003; Haddadin, De Luca and Albu-Schäffer 2017)",
        _observer(first_order),
        from_momentum,
    ),
    Detector(
        "filtered",
        "r = k * (tau - tau_s - f + C^T dq - G) - (dk/dt) * p, k the impulse response of K²/(s² + √2 K s + K²), "
        "* convolution",
        "filtered dynamics (Hsu, Bodson, Sastry and Paden 1987)",
        _observer(butterworth),
        from_momentum,
    ),
    Detector(
        "eso",
        "dp^/dt = u + d^ + 2K (p - p^), d(d^)/dt = K² (p - p^), r = -d^, so r = K²/(s + K)² tau_e",
        "linear extended state observer in the momentum, both poles at -K (Han 2009)",
        _observer(double_pole),
        from_momentum,
    ),
)


def detector_named(name: str) -> Detector:
    """The detector of that name.

    Raises:
        ConfigError: there is none.
    """
    found = next((one for one in DETECTORS if one.name == name), None)
    if found is None:
        raise ConfigError("there is no such detector", found=name, expected=", ".join(d.name for d in DETECTORS))
    return found


def joined_residual(parts: Iterable[tuple[BoolArray, Residual]]) -> Residual:
    """One residual; its levels and zeros of friction are those of the parts, too.

    Args:
        parts: rows (n,) of each part, which together are the log, and a residual of the whole log, which is written
            to. Of detectors that judge each joint.
    """
    remaining = iter(parts)
    rows, made = next(remaining)
    if made.effort_nm is not None:
        made = replace(made, effort_nm=made.effort_nm.copy(order="K"))  # that of the log's own
    levels, zeros = [(float(np.mean(rows)), made.levels)], [made.zeros]
    for rows, part in remaining:
        for mine, its in zip(_arrays(made), _arrays(part), strict=True):
            mine[rows] = its[rows]
        levels.append((float(np.mean(rows)), part.levels))
        zeros.append(part.zeros)
        for joint, amplitude in part.ripple_not_shown_nm.items():
            made.ripple_not_shown_nm[joint] = max(amplitude, made.ripple_not_shown_nm.get(joint, 0.0))
    return replace(made, levels=_levels_of(levels), zeros=_zeros_of(zeros))


def _arrays(residual: Residual) -> list[NDArray[Any]]:
    """Those of one row a sample, of both residuals of one log alike."""
    span = residual.span_nm or (None, None)
    every = (
        residual.torque_nm,
        residual.effort_nm,
        residual.state,
        residual.uncertainty_nm,
        residual.followed_nm,
        residual.hidden_nm,
        residual.balance.total_nm,
        *span,
    )
    return [array for array in every if array is not None]


def _levels_of(parts: Sequence[tuple[float, Mapping[str, LevelFacts]]]) -> dict[str, LevelFacts]:
    """Levels of friction over all parts, by the share of the log that each is."""
    out = {}
    for joint in dict.fromkeys(joint for _, levels in parts for joint in levels):
        shares, its = zip(*((share, levels[joint]) for share, levels in parts if joint in levels), strict=True)
        median, sd, mean = np.average([(x.median, x.sd, x.mean) for x in its], axis=0, weights=shares).tolist()
        out[joint] = LevelFacts(min(x.lowest for x in its), median, max(x.highest for x in its), sd, mean)
    return out


def _zeros_of(parts: Sequence[Mapping[str, ZeroFacts]]) -> dict[str, ZeroFacts]:
    """Zeros of the torque over all parts."""
    out: dict[str, ZeroFacts] = {}
    for joint, zero in ((joint, zero) for zeros in parts for joint, zero in zeros.items()):
        own = out.get(joint, zero)
        lowest, highest = min(own.lowest_nm, zero.lowest_nm), max(own.highest_nm, zero.highest_nm)
        out[joint] = ZeroFacts(lowest, highest, max(own.bound_nm, zero.bound_nm))
    return out
