"""Residual engines: how the external joint torque is estimated, behind one interface."""

from collaudit.core.detectors.balance import Balance, balance_torques
from collaudit.core.detectors.engines import ENGINES, Engine, engine_named

__all__ = ["ENGINES", "Balance", "Engine", "balance_torques", "engine_named"]
