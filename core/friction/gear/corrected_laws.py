"""Friction laws with the corrections that a friction file holds: load on the gear, ripple over position."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from collaudit.core.data.friction_correction import FrictionCorrection
from collaudit.core.friction.friction_model import FrictionModel


def corrected_laws(
    laws: Mapping[str, FrictionModel], corrections: Mapping[str, FrictionCorrection]
) -> dict[str, FrictionModel]:
    """The laws of all joints, those with a correction corrected."""
    out = dict(laws)
    for joint, found in corrections.items():
        if joint in out:
            out[joint] = replace(out[joint], load=found.load, ripple=found.ripple)
    return out
