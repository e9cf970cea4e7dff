"""``[detect.dynamic]`` tables, for a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from math import ceil

from collaudit.core.config.toml_text import key_item
from collaudit.core.data.detection_result import DynamicThreshold


def dynamic_toml(thresholds: Mapping[str, DynamicThreshold]) -> str:
    """The thresholds as TOML, rounded up to thousandths; empty when there are none.

    Args:
        thresholds: joint to its threshold.
    """
    import tomlkit

    joints = tomlkit.table(is_super_table=True)
    for joint, threshold in thresholds.items():
        table = tomlkit.table()
        for key, value in asdict(threshold).items():
            table.append(key, _rounded_up(value))
        joints.append(key_item(joint), table)
    detect = tomlkit.table(is_super_table=True)
    detect.append("dynamic", joints)
    made = tomlkit.document()
    made.append("detect", detect)
    return tomlkit.dumps(made) if thresholds else ""


def _rounded_up(value: float) -> float | int:
    thousandths = ceil(1e3 * value)
    return thousandths // 1000 if thousandths % 1000 == 0 else thousandths / 1e3
