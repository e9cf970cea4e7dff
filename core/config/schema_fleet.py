"""``[fleet]``: many robots under one configuration, and the rules that tell whose a log is."""

from pathlib import Path
from typing import Self

from pydantic import Field, model_validator

from collaudit.core.config.config_table import ConfigTable, Positive


class FleetRobot(ConfigTable):
    """One robot of a fleet: whose logs are its own, and what differs for it."""

    paths: list[str] = Field(
        [],
        description="Patterns of its logs' paths or URLs, with `*`, `?` and `[…]`; one that does not begin with `/` or "
        "a scheme matches the end of a path from a folder on.",
    )
    topics: list[str] = Field([], description="Topics, one of which its logs have.")
    joints: list[str] = Field([], description="Joint names that its logs have, all of them.")
    serials: list[str] = Field(
        [],
        description="Serial numbers, one of which its logs state: as a value of MCAP metadata or of a bag's "
        "`custom_data`, or in the leading `#` lines of a table.",
    )
    config: Path | None = Field(
        None,
        description="Configuration of this robot, in place of the common one but for `[policy]` and `[fleet]`; "
        "relative to the file that names it, as are the next two.",
    )
    urdf: Path | None = Field(None, description="URDF file.")
    friction: Path | None = Field(None, description="friction.json to judge with.")
    gamma_nm: Positive | str | dict[str, Positive] | None = Field(
        None, description='Threshold, as in `[detect]`: one number, by joint, or "auto".'
    )

    @model_validator(mode="after")
    def _rules(self) -> Self:
        if not (self.paths or self.topics or self.joints or self.serials):
            raise ValueError("no rule tells which logs are this robot's: give paths, topics, joints or serials")
        if isinstance(self.gamma_nm, str) and self.gamma_nm not in ("auto", "dynamic"):
            raise ValueError('gamma_nm is a number, a table by joint, "auto" or "dynamic"')
        return self


class FleetConfig(ConfigTable):
    """Many robots: whose a log is, and with what it is judged."""

    file: Path | None = Field(
        None, description="File with more `[fleet.robots.NAME]` tables, relative to this configuration."
    )
    robots: dict[str, FleetRobot] = Field(
        {},
        description="A robot of the fleet. A log is its own where every kind of rule that is given holds. A log of no "
        "robot, or of two, is not judged.",
    )
