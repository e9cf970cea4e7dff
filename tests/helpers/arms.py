"""Small Denavit-Hartenberg arms, as the [robot] table of a configuration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

#: Turns an axis along z level, so that gravity acts in the plane of a planar arm.
LEVEL = {"base_rpy_deg": (90, 0, 0)}


def dh_row(mass_kg: float, com_m: Sequence[float], inertia_kg_m2: Sequence[float], **geometry: float) -> dict[str, Any]:
    """One row.

    Args:
        mass_kg, com_m: of the link.
        inertia_kg_m2: about the centre of mass: xx, yy, zz, or all six.
        geometry: d, a, alpha, theta_offset; 0 when absent.
    """
    products = (0.0,) * (6 - len(inertia_kg_m2))
    inertia = (*inertia_kg_m2, *products)
    return {**geometry, "mass_kg": mass_kg, "com_m": tuple(com_m), "inertia_kg_m2": inertia}


def dh_robot(rows: Sequence[Mapping[str, Any]], convention: str = "standard", **keys: Any) -> dict[str, Any]:
    """The table; ``keys`` are its other keys, such as :data:`LEVEL` or ``armature_kg_m2``."""
    return {"dh_convention": convention, "dh": [dict(row) for row in rows], **keys}
