"""Recommended thresholds, written into a configuration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import tomlkit
from tomlkit.items import KeyType, SingleKey, Table

from collaudit.core.errors import ConfigError
from collaudit.core.recommend.arm_recommendation import ArmRecommendation
from collaudit.core.small_files import to_toml


def written_into(text: str, found: ArmRecommendation, robot: str | None = None) -> str:
    """A configuration with the recommended thresholds; everything else in it stays, comments included.

    The persistence is written where it was asked for or chosen, and where the file has none. A joint without a
    recommendation keeps its threshold.

    Args:
        text: of the file.
        found: the recommendation; of one that is refused nothing is written.
        robot: write the thresholds into this robot's table of the fleet instead of ``[detect]``.

    Raises:
        ConfigError: the file has no table for this robot.
    """

    document: Any = tomlkit.parse(text)
    gammas = {joint: rule.gamma_nm for joint, rule in found.joints.items() if rule.gamma_nm is not None}
    if robot is not None:
        robots = document.get("fleet", {}).get("robots", {})
        if robot not in robots:
            expected = f"a table [fleet.robots.{robot}]"
            raise ConfigError(
                "the file does not describe this robot", found=", ".join(robots) or None, expected=expected
            )
        _set(robots[robot], found, gammas)
        return tomlkit.dumps(document)
    if "detect" not in document:
        document.append("detect", tomlkit.table())
    detect = document["detect"]
    if found.chosen_by != "set" or not {"n", "persistence_ms"} & set(detect):
        detect.pop("n", None)
        detect["persistence_ms"] = round(1e3 * found.persistence_s, 6)
    _set(detect, found, gammas)
    return tomlkit.dumps(document)


def _set(table: Any, found: ArmRecommendation, gammas: dict[str, float]) -> None:
    """Change thresholds where they stand, so that comments beside them stay; else put a table in their place."""
    stated = table.get("gamma_nm")
    if isinstance(stated, dict):
        for joint, gamma in gammas.items():
            stated[joint] = gamma
        return
    of_all = dict.fromkeys(found.joints, float(stated)) if isinstance(stated, int | float) else {}
    table.pop("gamma_nm", None)
    table.append("gamma_nm", _table(of_all | gammas))


def _table(gammas: Mapping[str, float]) -> Table:
    thresholds = tomlkit.table()
    for joint, gamma in gammas.items():
        thresholds.append(_key(joint), gamma)
    return thresholds


def _key(name: str) -> SingleKey:
    """A quoted key, in which nothing can hide."""
    return SingleKey(name, KeyType.Basic, original=to_toml(name))
