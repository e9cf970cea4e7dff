"""Coefficients of the few recursive filters there are, bit for bit those of ``scipy.signal`` and without its import."""

from __future__ import annotations

import functools
from typing import Any

import numpy as np

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.numeric.compiled_scipy import compiled_function

_EXPONENTIAL = "linalg/_matfuncs_expm"


@functools.lru_cache(maxsize=64)
def butterworth_low_pass(corner: float) -> tuple[FloatArray, FloatArray]:
    """Numerator and denominator (3,) of the second-order Butterworth low-pass: ``scipy.signal.butter(2, corner)``.

    Args:
        corner: -3 dB frequency as a share of half the sample rate, above 0 and below 1.

    Returns:
        Both are read-only: a log asks for the same ones a hundred times.

    Poles of the prototype at exp(±3πi/4), scaled to the warped corner, and the bilinear transform at twice the rate of
    the frequencies (A. V. Oppenheim, R. W. Schafer, *Discrete-Time Signal Processing*, ch. 7).
    """
    warped = float(4.0 * np.tan(np.pi * corner / 2.0))  # not math.tan, whose last bit may differ
    poles = warped * -np.exp(1j * np.pi * np.array([-1.0, 1.0]) / 4.0)
    gain = warped**2 * np.real(1.0 / np.prod(4.0 - poles))
    numerator: FloatArray = gain * np.poly(np.array([-1.0, -1.0]))
    denominator: FloatArray = np.real(np.poly((4.0 + poles) / (4.0 - poles)))
    numerator.flags.writeable = denominator.flags.writeable = False
    return numerator, denominator


def settled_state(b: FloatArray, a: FloatArray) -> FloatArray:
    """(m,) state of a filter whose input has been 1 for ever: ``scipy.signal.lfilter_zi``.

    Args:
        b, a: numerator and denominator in z, the first value of the denominator not 0.

    Returns:
        The state, read-only.

    It solves z = A z + B with A the transposed companion matrix of the denominator and B = b_k - a_k b_0.
    """
    return _settled(tuple(b.tolist()), tuple(a.tolist()))


@functools.lru_cache(maxsize=64)
def _settled(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> FloatArray:
    b, a = np.array(numerator), np.array(denominator)
    size = max(b.size, a.size)
    b, a = (np.concatenate([x / a[0], np.zeros(size - x.size)]) for x in (b, a))
    companion = np.zeros((size - 1, size - 1))
    companion[0] = -a[1:]
    companion[np.arange(1, size - 1), np.arange(size - 2)] = 1.0
    state: FloatArray = np.linalg.solve(np.eye(size - 1) - companion.T, b[1:] - a[1:] * b[0])
    state.flags.writeable = False
    return state


def first_order_hold(numerator: FloatArray, denominator: FloatArray, period_s: float) -> tuple[FloatArray, FloatArray]:
    """A filter in s as one in z, exact for inputs that are straight between samples.

    Args:
        numerator, denominator: of the filter in s, highest power first, the numerator at most as long.
        period_s: sample period, s.

    Returns:
        Numerator and denominator (m,) in z: ``scipy.signal.cont2discrete`` with ``method="foh"``.

    The state space in controller canonical form, and the exponential of its block matrix (G. F. Franklin, J. D.
    Powell, M. L. Workman, *Digital Control of Dynamic Systems*, 6.3.2).
    """
    den = denominator / denominator[0]
    num = np.concatenate([np.zeros(den.size - numerator.size), numerator / denominator[0]])
    order = den.size - 1
    block = np.zeros((order + 2, order + 2))
    block[0, :order] = -den[1:] * period_s
    block[np.arange(1, order), np.arange(order - 1)] = period_s
    block[0, order] = period_s
    block[order, order + 1] = 1.0
    power = matrix_exponential(block)
    a, before, after = power[:order, :order], power[:order, order], power[:order, order + 1]
    b = before - after + a @ after
    c = num[1:] - num[0] * den[1:]
    d = num[0] + c @ after
    discrete: FloatArray = np.asarray(np.poly(a), dtype=np.float64)
    return np.asarray(np.poly(a - np.outer(b, c)) + (d - 1.0) * discrete), discrete


def matrix_exponential(a: FloatArray) -> FloatArray:
    """(n, n) exponential of a matrix by a Padé approximant, as ``scipy.linalg.expm``, whose import takes 0.25 s.

    A. H. Al-Mohy, N. J. Higham, *A new scaling and squaring algorithm for the matrix exponential*, SIAM J. Matrix Anal.
    Appl. 31, 2009. Matrices that need no scaling, which are those of filters well below the sample rate, go to the
    compiled approximant directly; others to SciPy's public function.
    """
    if np.array_equal(a, np.diag(np.diag(a))):
        return np.diag(np.exp(np.diag(a)))
    compiled = _compiled_exponential()
    found = None if compiled is None else _approximant(*compiled, a)
    if found is None:
        from scipy.linalg import expm

        return np.asarray(expm(a))
    return found


def _approximant(structure: Any, approximant: Any, a: FloatArray) -> FloatArray | None:
    """The exponential; None where the matrix has to be scaled, or the functions are not those that are meant."""
    work = np.empty((5, *a.shape))
    work[0] = a
    order, scaling = structure(work)
    if order < 0 or scaling != 0 or approximant(work, order) != 0:
        return None
    if not np.tril(a, -1).any():
        return np.asarray(np.triu(work[0]))
    return np.asarray(work[0] if np.triu(a, 1).any() else np.tril(work[0]))


@functools.cache
def _compiled_exponential() -> tuple[Any, Any] | None:
    structure = compiled_function(_EXPONENTIAL, "pick_pade_structure", callable)
    approximant = compiled_function(_EXPONENTIAL, "pade_UV_calc", lambda found: _agrees(structure, found))
    return None if structure is None or approximant is None else (structure, approximant)


def _agrees(structure: Any, approximant: Any) -> bool:
    """Whether a turn by a tenth and a shift come out right."""
    turn, shift = np.array([[0.0, -0.1], [0.1, 0.0]]), np.array([[0.0, 1.0], [0.0, 0.0]])
    turned, shifted = (_approximant(structure, approximant, a) for a in (turn, shift))
    if turned is None or shifted is None:
        return False
    expected = np.array([[np.cos(0.1), -np.sin(0.1)], [np.sin(0.1), np.cos(0.1)]])
    return bool(np.allclose(turned, expected, rtol=0.0, atol=1e-14) and np.allclose(shifted, [[1.0, 1.0], [0.0, 1.0]]))
