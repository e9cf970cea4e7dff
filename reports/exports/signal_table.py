"""The signals of audits as one table: a row a sample, a column a quantity of a joint, states in words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pyarrow as pa

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.signals import State
from collaudit.reports.values.visible_text import visible

_QUANTITIES = ("position_rad", "velocity_rad_s", "measured_nm", "model_nm", "residual_nm", "least_nm", "most_nm")


def signal_table(audits: Sequence[Audit]) -> pa.Table:
    """Columns ``log``, ``time_s`` and, of each joint, ``QUANTITY:JOINT``; what is not known is null.

    Args:
        audits: of one or several logs; a joint that a log does not have is null there.
    """
    return pa.concat_tables([_table(audit) for audit in audits], promote_options="default")


def _table(audit: Audit) -> pa.Table:
    signals = audit.signals
    count = len(signals.time_s)
    names = pa.array([visible(audit.result.log.name)])
    columns: dict[str, pa.Array] = {
        "log": pa.DictionaryArray.from_arrays(pa.array(np.zeros(count, np.int32)), names),
        "time_s": pa.array(signals.time_s),
    }
    codes = pa.array([state.code for state in State])
    for j, joint in enumerate(signals.joint_names):
        shown = visible(joint)
        for quantity in _QUANTITIES:
            values = getattr(signals, quantity)
            if values is not None:
                columns[f"{quantity}:{shown}"] = pa.array(values[:, j].astype(float), from_pandas=True)
        columns[f"gamma_nm:{shown}"] = pa.array(np.full(count, signals.gamma_nm[j]), from_pandas=True)
        columns[f"state:{shown}"] = pa.DictionaryArray.from_arrays(
            pa.array(signals.state[:, j].astype(np.int32)), codes
        )
    if signals.wrench is not None:
        for k, axis in enumerate(("fx_n", "fy_n", "fz_n", "mx_nm", "my_nm", "mz_nm")):
            columns[f"wrench:{axis}"] = pa.array(signals.wrench[:, k].astype(float), from_pandas=True)
    return pa.table(columns)
