"""The data-driven law: ``A + D·v + Σ W_k exp(-(ln(v/v_k)/w)²/2)``, level beyond the outer centres v_k."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from collaudit.core.friction_laws.friction_law import Interval, Parameter, RidgeLaw, Values
from collaudit.core.numeric.arrays import FloatArray

_MOST_CENTRES = 8


def _layout(speed: FloatArray) -> dict[str, float]:
    """Centres v1, v2, … from the slowest to the fastest speed, and the width w, a ratio of speeds (logarithmic)."""
    centres = np.geomspace(speed.min(), speed.max(), max(3, min(_MOST_CENTRES, speed.size // 3)))
    width = float(np.log(centres[1] / centres[0]))
    return {f"v{k}": float(v) for k, v in enumerate(centres, 1)} | {"w": width}


def _bumps(speed: FloatArray, values: Values) -> FloatArray:
    """(n, k) Gaussian bumps over the logarithm of speed."""
    count = sum(symbol.startswith("v") for symbol in values)
    centres = np.array([values[f"v{k}"] for k in range(1, count + 1)])
    x = np.log(np.clip(speed, centres[0], centres[-1]))
    return np.asarray(np.exp(-0.5 * ((x[..., None] - np.log(centres)) / values["w"]) ** 2))


def _only_the_curve(_ci95: Mapping[str, Interval | None]) -> tuple[str, ...]:
    return ("The law is data-driven: only its curve means anything, which the page draws.",)


RBF = RidgeLaw(
    name="rbf",
    title="data-driven",
    formula="f(v) = A + D·v + Gaussian bumps over the logarithm of speed",
    parameters=(
        Parameter("A", "friction"),
        Parameter("D", "viscous"),
        Parameter("W", "friction", numbered=True),
        Parameter("v", "speed", numbered=True),
        Parameter("w", "number"),
    ),
    data_driven=True,
    remarks=_only_the_curve,
    layout=_layout,
    columns=_bumps,
    least_points=8,
    least_held_out=6,
)
