"""``[policy]``, what makes an audit fail or unable to judge; ``[fleet]``, many robots."""

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from collaudit.core.config.config_table import ConfigTable, NonNegative, Positive, about

#: A push that must alarm lasts so long, s.
PUSH_S = 0.2


class PolicyConfig(ConfigTable, frozen=True, kw_only=True):
    """What makes an audit fail, and what makes it unable to judge."""

    max_collisions: Annotated[
        int,
        Meta(ge=0),
        about("The audit fails if there are more contacts than this; alarms of several joints are one contact."),
    ] = 0
    max_near_misses_per_hour: Annotated[
        NonNegative | None,
        about("The audit fails if the lower 95 % bound of the near misses an hour exceeds this."),
    ] = None
    max_disturbed_at_rest: Annotated[
        int,
        Meta(ge=0),
        about("Pushes of standing joints, too weak to alarm, that a log may have; with more it is not judged."),
    ] = 0
    observable_n: Annotated[
        dict[str, Positive],
        about(
            "Contact force that must alarm within 0.2 s, N, by place: `tool`, `forearm` (its outer end), or a link's "
            "name. Of a place that is absent: 100 at the tool, 150 at the forearm, at most half of what the arm can "
            "exert there. None is asked where the table is absent and `observable_nm` covers every watched joint."
        ),
    ] = {}
    observable_share: Annotated[
        float,
        Meta(gt=0, le=1),
        about(
            "Least share of the time in motion in which the force of `observable_n` would have alarmed, from 80 % of "
            "the directions that load a watched joint, and each torque of `observable_nm`; with less the log is not "
            "judged. If the arm never moves, of all time."
        ),
    ] = 0.9
    observable_nm: Annotated[
        Positive | dict[str, Positive] | None,
        about("External torque that must alarm, N·m (N if prismatic); one number, or by joint. Absent: none is asked."),
    ] = None
    same_log: Annotated[
        Literal["refuse", "folds", "allow"],
        about(
            "refuse: a log is not judged by friction and thresholds that were fitted on it alone; folds: each of its "
            "parts is, by a fit of the others, and the verdict names what that cannot see; allow: it is, and the "
            "verdict excludes that."
        ),
    ] = "refuse"
    max_hidden_s: Annotated[
        Positive,
        about(
            "Longest stretch in which the force of `observable_n`, or a torque of `observable_nm`, may go unnoticed, "
            "at rest and in gaps too, s; with a longer one the log is not judged."
        ),
    ] = 1800.0
    min_coverage: Annotated[
        float,
        Meta(ge=0, le=1),
        about(
            "Least share of a watched joint's time in motion that could be judged, and of the log that must "
            "hold its values; with less the log is not judged. Gaps and missing values count as motion, "
            "unless the joint rested at one place before and after."
        ),
    ] = 0.8
    known: Annotated[
        Literal["break", "allow"],
        about(
            "break: a contact that earlier nights had, too, breaks the policy like a new one; allow: the "
            "verdict says it. One that is clearly harder, or comes back after a night without it, always "
            "breaks it."
        ),
    ] = "break"
    other_files: Annotated[
        Literal["not_judged", "list", "ignore"],
        about(
            "Files in a folder of logs that are no logs by name: not_judged: each counts as not judged; "
            "list: they are named only; ignore: not even that. What a recorder left behind, and archives "
            "that may hold logs, always count as not judged."
        ),
    ] = "not_judged"


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
    config: Annotated[
        Path | None,
        about(
            "Configuration of this robot, in place of the common one but for `[fleet]`; of `[policy]` what it states "
            "differs. Relative to the file that names it, as is the next."
        ),
    ] = None
    friction: Annotated[Path | None, about("friction.json to judge with.")] = None
    gamma_nm: Annotated[
        Positive | str | dict[str, Positive] | None,
        about('Threshold, as in `[detect]`: one number, by joint, or "auto".'),
    ] = None

    def __post_init__(self) -> None:
        if not (self.paths or self.topics or self.joints):
            raise ValueError("no rule tells which logs are this robot's: give paths, topics or joints")
        if isinstance(self.gamma_nm, str) and self.gamma_nm not in ("auto", "sharpest"):
            raise ValueError('gamma_nm is a number, a table by joint, "auto" or "sharpest"')


class FleetConfig(ConfigTable, frozen=True, kw_only=True):
    """Many robots: whose a log is, and with what it is judged."""

    robots: Annotated[
        dict[str, FleetRobot],
        about(
            "A robot of the fleet. A log is its own where every kind of rule that is given holds. A log of two is "
            "judged once for each where they have topics, or joints, of their own in it; else it is not judged, as "
            "is a log of none."
        ),
    ] = {}
