"""Quantiles and tails of SciPy's special functions, without the package around them.

Importing ``scipy.special`` takes 0.2 s, of which its compiled functions take a tenth; the rest wraps them for other
array libraries. The compiled modules are loaded alone, as :mod:`compiled_scipy` does it, under the names that the
package gives them, so that a later import of the package finds them. Where that fails the package is imported.
"""

from __future__ import annotations

import functools
import importlib
import sys
import threading
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from collaudit.core.numeric.compiled_scipy import compiled_module

#: Numbers, or arrays of them that go together.
Real: TypeAlias = float | NDArray[np.floating[Any]]

_PACKAGE = "scipy.special"
#: Each needs those before it. Some versions of SciPy have other parts: then the last does not load alone.
_PARTS = ("_ufuncs_cxx", "_ellip_harm_2", "_special_ufuncs", "_gufuncs", "_ufuncs")
_LOCK = threading.Lock()


def student_quantile(freedom: Real, share: float) -> Any:
    """Student's t with so many degrees of freedom that is not exceeded with this probability."""
    return _functions().stdtrit(freedom, share)


def student_share(freedom: Real, t: Real) -> Any:
    """Probability that Student's t with so many degrees of freedom does not exceed ``t``."""
    return _functions().stdtr(freedom, t)


def fisher_tail(above: Real, below: Real, ratio: Real) -> Any:
    """Probability that a ratio of variances with these degrees of freedom exceeds ``ratio``, 0 or more."""
    return _functions().fdtrc(above, below, ratio)


def fisher_quantile(above: Real, below: Real, share: float) -> Any:
    """Ratio of variances with these degrees of freedom that is not exceeded with this probability."""
    return _functions().fdtri(above, below, share)


def gamma_quantile(shape: Real, share: float) -> Any:
    """Quantile of the gamma distribution with this shape and scale 1."""
    return _functions().gammaincinv(shape, share)


def binomial_quantile(share: float, trials: float, chance: float) -> Any:
    """Number of successes, not rounded, that is not exceeded with this probability (``scipy.special.bdtrik``)."""
    return _functions().bdtrik(share, trials, chance)


def binomial_tail(successes: int, trials: int, chance: float) -> Any:
    """Probability of more than so many successes."""
    return _functions().bdtrc(successes, trials, chance)


@functools.cache
def _functions() -> Any:
    with _LOCK:
        alone = None if _PACKAGE in sys.modules else _alone()
    return importlib.import_module(_PACKAGE) if alone is None else alone


def _alone() -> Any | None:
    """The compiled functions; None, and nothing left behind, where they do not load or do not say what they should."""
    before = set(sys.modules)
    found: Any | None = None
    for part in _PARTS:
        name = f"{_PACKAGE}.{part}"
        found = sys.modules.get(name) or compiled_module(f"special/{part}", name)
        if found is not None:
            sys.modules[name] = found
    if found is not None and _PACKAGE not in sys.modules and _agrees(found):
        return found
    for name in set(sys.modules) - before:
        if name.startswith(f"{_PACKAGE}.") and _PACKAGE not in sys.modules:
            del sys.modules[name]
    return None


def _agrees(functions: Any) -> bool:
    """Whether they give a few values that are known in closed form."""
    try:
        values = (
            functions.stdtr(1.0, 1.0) - 0.75,
            functions.stdtrit(1.0, 0.75) - 1.0,
            functions.fdtrc(2.0, 2.0, 1.0) - 0.5,
            functions.fdtri(2.0, 2.0, 0.5) - 1.0,
            functions.gammaincinv(1.0, 0.5) - 0.6931471805599453,
            functions.bdtrc(0, 2, 0.5) - 0.75,
            functions.bdtrik(0.75, 2.0, 0.5) - 1.0,
        )
    except (AttributeError, TypeError):
        return False
    return all(abs(value) < 1e-9 for value in values)
