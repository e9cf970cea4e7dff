"""The family of residual engines: equation, source, kernel.

All of them estimate the same quantity, tau_e of eq. (5). Written with the generalized momentum p = M(q) dq,

    tau_e = tau - tau_s - f + C(q, dq)^T dq - G(q) - dp/dt,

each engine is a kernel G(s) applied to this: r = G(s) [tau - tau_s - f + C^T dq - G] - s G(s) p. With
acceleration at hand that is G(s) applied to the direct residual; without it, s G(s) is itself a filter. The two
forms are tested against each other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from collaudit.core.errors import ConfigError
from collaudit.core.numeric.kernel import Kernel, butterworth, double_pole, first_order


@dataclass(frozen=True, slots=True)
class Engine:
    """One way to estimate external joint torque.

    Attributes:
        name: as in ``[detect] detector``.
        equation: what it computes.
        source: where it comes from.
        needs_acceleration: when causal; after the fact every engine may use it.
        scalar: one residual for the whole arm: detection without isolation.
        make_kernel: from gain (1/s; of ``direct`` the filter's corner) and causality.
    """

    name: str
    equation: str
    source: str
    needs_acceleration: bool
    scalar: bool
    make_kernel: Callable[[float, bool], Kernel]


ENGINES: dict[str, Engine] = {
    engine.name: engine
    for engine in (
        Engine(
            "direct",
            "r = G(s) [tau - tau_s - (M ddq + C dq + f + G)], G as narrow as the filter of dq and ddq",
            "eq. (5) of the paper, its sides filtered alike",
            True,
            False,
            butterworth,
        ),
        Engine(
            "momentum",
            "r = K [p - ∫(tau - tau_s - f + C^T dq - G - r) dt], so r = K/(s + K) tau_e",
            "generalized-momentum observer (De Luca and Mattone 2003; Haddadin, De Luca and Albu-Schäffer 2017)",
            False,
            False,
            first_order,
        ),
        Engine(
            "filtered",
            "r = k * (tau - tau_s - f + C^T dq - G) - (dk/dt) * p, k the impulse response of "
            "K²/(s² + √2 K s + K²), * convolution",
            "filtered dynamics (Hsu, Bodson, Sastry and Paden 1987; the paper's [9], [15])",
            False,
            False,
            butterworth,
        ),
        Engine(
            "eso",
            "dp^/dt = u + d^ + 2K (p - p^), d(d^)/dt = K² (p - p^), r = -d^, so r = K²/(s + K)² tau_e",
            "linear extended state observer in the momentum, both poles at -K (Han 2009; the paper's [10])",
            False,
            False,
            double_pole,
        ),
        Engine(
            "energy",
            "r = K/(s + K) [dq^T tau_e] / sqrt(K/(s + K) [|dq|²] + v0²): external power over speed",
            "energy observer (De Luca, Albu-Schäffer, Haddadin and Hirzinger 2006), divided by speed to N·m",
            False,
            True,
            first_order,
        ),
    )
}


def engine_named(name: str) -> Engine:
    """The engine of that name.

    Raises:
        ConfigError: there is none.
    """
    if name not in ENGINES:
        raise ConfigError("there is no such detector", found=name, expected=", ".join(ENGINES))
    return ENGINES[name]
