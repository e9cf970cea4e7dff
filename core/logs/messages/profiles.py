"""Which profile reads a topic: that of its type, or the one that the configuration states."""

from __future__ import annotations

from collaudit.core.config.schema import LogConfig
from collaudit.core.errors import ConfigError
from collaudit.core.vendors.message_profiles import PROFILES, Profile

#: Name of the profiles that the configuration makes.
CONFIGURED = "configured"
_BY_TYPE = {kind: profile for profile in PROFILES for kind in profile.types}


def profile_of(type_name: str) -> Profile | None:
    """The profile that reads a message type, or None."""
    return _BY_TYPE.get(type_name)


def configured(settings: LogConfig, topic: str, type_name: str) -> Profile | None:
    """The profile that the configuration itself gives for a topic, if it does.

    Raises:
        ConfigError: paths are given for a topic that is not named.
    """
    fields = settings.fields
    if fields is None:
        return None
    for named, path in (("joint_states", fields.position), ("wrench", fields.wrench)):
        if path is not None and getattr(settings, named) is None:
            raise ConfigError(f"[log.fields] says where fields stand on a topic that [log] {named} does not name")
    if fields.position is not None and _same(topic, settings.joint_states):
        path = fields.names if isinstance(fields.names, str) else None
        fixed = tuple(fields.names) if isinstance(fields.names, list) else ("joint{i}",)
        return Profile(
            name=CONFIGURED,
            role="joint_states",
            types=(type_name,),
            stamp=fields.stamp,
            names=path,
            fixed_names=fixed if path is None else (),
            position=fields.position,
            velocity=fields.velocity,
            effort=fields.effort,
            temperature=fields.temperature,
            joint_torque=fields.joint_torque,
        )
    if fields.wrench is not None and _same(topic, settings.wrench):
        return Profile(CONFIGURED, "wrench", (type_name,), stamp=fields.wrench_stamp, wrench=fields.wrench)
    return None


def _same(topic: str, named: str | None) -> bool:
    return named is not None and topic.strip("/") == named.strip("/")
