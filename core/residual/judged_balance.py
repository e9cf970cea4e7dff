"""An engine's balance in the judged joints only; the dynamics need all of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from collaudit.core.config.schema import DetectConfig
from collaudit.core.prepare.prepared import Prepared
from collaudit.core.residual.balance import Balance, balance_torques


def judged_balance(prepared: Prepared, config: DetectConfig, name: str | None = None) -> Balance:
    """Torque balance of a prepared log's judged joints by the configured engine, or the named one."""
    balance = balance_torques(prepared.series, prepared.robot, prepared.rigid_nm, prepared.contact_nm, config, name)
    columns = prepared.columns()
    if len(columns) == len(prepared.series.joint_names):
        return balance
    return replace(
        balance,
        total_nm=None if balance.total_nm is None else np.asfortranarray(balance.total_nm[:, columns]),
        velocity_rad_s=np.asfortranarray(balance.velocity_rad_s[:, columns]),
    )
