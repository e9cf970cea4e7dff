"""Minimum and root of a function of one number, without the import of ``scipy.optimize``, which takes half a second."""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from typing import Any

from collaudit.core.numeric.compiled_scipy import compiled_function

Function = Callable[[float], float]

_GOLDEN = 0.5 * (3.0 - math.sqrt(5.0))
_ROOT_EPS = math.sqrt(2.2e-16)
_MOST_STEPS = 500
_RELATIVE = 4.0 * 2.0**-52
_MOST_ROOT_STEPS = 100


def bounded_minimum(function: Function, low: float, high: float, tolerance: float) -> float:
    """Where a function has its minimum between two bounds, by golden sections and parabolas.

    R. P. Brent, Algorithms for Minimization without Derivatives, 1973, ch. 5 (localmin). The order of operations gives
    the digits of ``scipy.optimize.minimize_scalar(method="bounded")``.

    Args:
        function: of one number; of one minimum between the bounds, else one of them is found.
        low, high: bounds.
        tolerance: of the place.
    """
    best = second = third = low + _GOLDEN * (high - low)
    f_best = f_second = f_third = function(best)
    step = before = 0.0
    for _ in range(_MOST_STEPS - 1):
        middle = 0.5 * (low + high)
        least = _ROOT_EPS * abs(best) + tolerance / 3.0
        if abs(best - middle) <= 2.0 * least - 0.5 * (high - low):
            break
        parabola = None
        if abs(before) > least:
            parabola = _parabola_step((best, second, third), (f_best, f_second, f_third), before, low, high)
            before = step
        if parabola is None:
            before = low - best if best >= middle else high - best
            step = _GOLDEN * before
        else:
            step, at = parabola, best + parabola
            if at - low < 2.0 * least or high - at < 2.0 * least:
                step = least if middle >= best else -least
        at = best + math.copysign(max(abs(step), least), step if step else 1.0)
        f_at = function(at)
        if f_at <= f_best:
            low, high = (best, high) if at >= best else (low, best)
            third, f_third, second, f_second, best, f_best = second, f_second, best, f_best, at, f_at
            continue
        low, high = (at, high) if at < best else (low, at)
        if f_at <= f_second or second == best:
            third, f_third, second, f_second = second, f_second, at, f_at
        elif f_at <= f_third or third in (best, second):
            third, f_third = at, f_at
    return best


def _parabola_step(
    at: tuple[float, float, float], value: tuple[float, float, float], before: float, low: float, high: float
) -> float | None:
    """Step from the best of three points to the minimum of their parabola; None where it is too long or leads out."""
    (best, second, third), (f_best, f_second, f_third) = at, value
    r = (best - second) * (f_best - f_third)
    q = (best - third) * (f_best - f_second)
    p = (best - third) * q - (best - second) * r
    q = 2.0 * (q - r)
    if q > 0.0:
        p = -p
    q = abs(q)
    inside = abs(p) < abs(0.5 * q * before) and q * (low - best) < p < q * (high - best)
    return p / q if inside else None


def root(function: Function, low: float, high: float, tolerance: float) -> float:
    """Where a function of opposite signs at two bounds is zero, as ``scipy.optimize.brentq`` computes it.

    Args:
        function: of one number.
        low, high: bounds.
        tolerance: of the place.

    Raises:
        ValueError: the function has the same sign at both bounds, or is not a number somewhere.
        RuntimeError: it is not found in a hundred steps.
    """
    compiled = _compiled()
    if compiled is None:
        from scipy.optimize import brentq

        return float(brentq(function, low, high, xtol=tolerance))

    def checked(x: float) -> float:
        value = function(x)
        if math.isnan(value):
            raise ValueError(f"the function is not a number at {x:g}")
        return value

    return float(compiled(checked, low, high, tolerance, _RELATIVE, _MOST_ROOT_STEPS, (), False, True))


@functools.cache
def _compiled() -> Any | None:
    return compiled_function("optimize/_zeros", "_brentq", _agrees)


def _agrees(function: Any) -> bool:
    """Whether it finds that 2 - x is zero at 2."""
    found = function(lambda x: 2.0 - x, 0.0, 3.0, 1e-12, _RELATIVE, _MOST_ROOT_STEPS, (), False, True)
    return abs(float(found) - 2.0) < 1e-9
