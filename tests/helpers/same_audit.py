"""Comparing what two audits say."""

from __future__ import annotations

from typing import Any


def differences(found: Any, expected: Any, where: str = "") -> list[str]:
    """Where two results differ by more than the last digits: decimals are exact beyond what a float64 holds."""
    if isinstance(expected, dict) and isinstance(found, dict) and list(found) == list(expected):
        return [line for key in expected for line in differences(found[key], expected[key], f"{where}.{key}")]
    if isinstance(expected, list) and isinstance(found, list) and len(found) == len(expected):
        both = enumerate(zip(found, expected, strict=True))
        return [line for k, (one, other) in both for line in differences(one, other, f"{where}[{k}]")]
    if (
        isinstance(expected, float)
        and isinstance(found, float)
        and abs(found - expected) <= max(1e-6 * abs(expected), 1e-9)
    ):
        return []
    return [] if found == expected else [f"{where}: {found} instead of {expected}"]


def alike(found: Any, expected: Any) -> None:
    """Fail with every place at which two results differ."""
    assert not differences(found, expected), "\n".join(differences(found, expected))
