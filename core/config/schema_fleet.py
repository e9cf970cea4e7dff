"""``[fleet]``: many robots under one configuration, and the rules that tell whose a log is."""

from pathlib import Path
from typing import Annotated

from collaudit.core.config.config_table import ConfigTable, Positive, about


class FleetRobot(ConfigTable, frozen=True, kw_only=True):
    """One robot of a fleet: whose logs are its own, and what differs for it."""

    paths: Annotated[
        list[str],
        about(
            "Patterns of its logs' paths or URLs, with `*`, `?` and `[…]`; one that does not begin with `/` or "
            "a scheme matches the end of a path from a folder on."
        ),
    ] = []
    topics: Annotated[list[str], about("Topics, one of which its logs have.")] = []
    joints: Annotated[list[str], about("Joint names, or columns, that its logs have, all of them.")] = []
    serials: Annotated[
        list[str],
        about(
            "Serial numbers, one of which its logs state: as a value of MCAP metadata or of a bag's "
            "`custom_data`, or in the leading `#` lines of a table."
        ),
    ] = []
    config: Annotated[
        Path | None,
        about(
            "Configuration of this robot, in place of the common one but for `[policy]` and `[fleet]`; "
            "relative to the file that names it, as are the next two."
        ),
    ] = None
    urdf: Annotated[Path | None, about("URDF file.")] = None
    friction: Annotated[Path | None, about("friction.json to judge with.")] = None
    gamma_nm: Annotated[
        Positive | str | dict[str, Positive] | None,
        about('Threshold, as in `[detect]`: one number, by joint, or "auto".'),
    ] = None

    def __post_init__(self) -> None:
        """At least one rule, and a threshold that is one."""
        if not (self.paths or self.topics or self.joints or self.serials):
            raise ValueError("no rule tells which logs are this robot's: give paths, topics, joints or serials")
        if isinstance(self.gamma_nm, str) and self.gamma_nm != "auto":
            raise ValueError('gamma_nm is a number, a table by joint, or "auto"')


class FleetConfig(ConfigTable, frozen=True, kw_only=True):
    """Many robots: whose a log is, and with what it is judged."""

    file: Annotated[
        Path | None, about("File with more `[fleet.robots.NAME]` tables, relative to this configuration.")
    ] = None
    robots: Annotated[
        dict[str, FleetRobot],
        about(
            "A robot of the fleet. A log is its own where every kind of rule that is given holds. A log of two is "
            "judged once for each where they have topics, or joints, of their own in it; else it is not judged, as "
            "is a log of none."
        ),
    ] = {}
