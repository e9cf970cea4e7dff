"""The settings of each log: the common ones, those of its robot, and where the policy differs for it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from collaudit.core.config import LoadedConfig, config_sha256, load_config
from collaudit.core.config.schema import FleetConfig, FleetRobot, PolicyConfig
from collaudit.core.errors import ConfigError
from collaudit.core.policy.name_patterns import concerns

#: Keys of an override that are no limits: which logs it means, and what is merged.
_OF_OVERRIDE = {"robots", "logs", "levels", "findings"}


class LogSettings:
    """Settings by robot and policy, each made once and shared by the logs that have them."""

    def __init__(self, common: LoadedConfig, flags: Mapping[str, object], robots: Mapping[str, FleetRobot]) -> None:
        """Read and check the settings of every robot.

        Args:
            common: the configuration, flags applied.
            flags: the flags alone: they win over what a robot has.
            robots: of the fleet.

        Raises:
            ConfigError: a robot's configuration cannot be used.
        """
        self._common = common
        self._of_robot = {name: _of_robot(common, flags, name, robot) for name, robot in robots.items()}
        self._made: dict[str, LoadedConfig] = {}

    def robot_settings(self) -> list[LoadedConfig]:
        """The settings of every robot; the common ones where there is no fleet."""
        return list(self._of_robot.values()) or [self._common]

    def of(self, place: str, robot: str | None) -> LoadedConfig:
        """Settings of one log.

        Args:
            place: its path or URL.
            robot: its robot's name, None without a fleet.
        """
        base = self._common if robot is None else self._of_robot[robot]
        policy = policy_of(self._common.config.policy, place, robot)
        key = f"{robot}\n{policy!r}"
        if key not in self._made:
            config = base.config.changed({"policy": policy, "fleet": FleetConfig()})
            self._made[key] = replace(base, config=config, sha256=config_sha256(config))
        return self._made[key]


def policy_of(policy: PolicyConfig, place: str, robot: str | None) -> PolicyConfig:
    """The policy that holds for one log: limits and levels of every override that means it, the last one winning.

    Overrides and waivers are no part of it.
    """
    changes: dict[str, object] = {"overrides": [], "waivers": []}
    levels, findings = dict(policy.levels), dict(policy.findings)
    for override in policy.overrides:
        if concerns(override, place, robot):
            changes |= {name: getattr(override, name) for name in override.given - _OF_OVERRIDE}
            levels |= override.levels
            findings |= override.findings
    return policy.changed({**changes, "levels": levels, "findings": findings})


def _of_robot(common: LoadedConfig, flags: Mapping[str, object], name: str, robot: FleetRobot) -> LoadedConfig:
    """The robot's own configuration, or the common one; then what the fleet states of it; then the flags."""
    if robot.config is not None:
        own = load_config(robot.config).config
        wrong = [table for table in ("policy", "fleet") if table in own.given]
        if wrong:
            raise ConfigError(
                f"the configuration of robot {name!r} holds what is common to the fleet",
                where=str(robot.config),
                found=", ".join(f"[{table}]" for table in wrong),
                hint="put it into the configuration that names the fleet; [[policy.overrides]] differ by robot",
            )
    stated = {"robot.urdf": robot.urdf, "friction.file": robot.friction, "detect.gamma_nm": robot.gamma_nm}
    own_keys = {
        key: str(value.absolute()) if hasattr(value, "absolute") else value
        for key, value in stated.items()
        if value is not None
    }
    of_robot = {key: value for key, value in flags.items() if not key.startswith(("policy.", "fleet."))}
    return load_config(robot.config or common.path, {**own_keys, **of_robot})
