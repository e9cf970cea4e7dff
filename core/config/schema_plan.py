"""``[plan]``: limits and surroundings that a planned motion keeps within, where the robot's description has none."""

from typing import Annotated

from collaudit.core.config.config_table import ConfigTable, NonNegative, Positive, Vec3, about

_ByJoint = dict[str, Positive]


class PlanConfig(ConfigTable, frozen=True, kw_only=True):
    """What a planned motion (`collaudit plan`) keeps within; what is stated here replaces the description's limits."""

    start_rad: Annotated[
        dict[str, float],
        about(
            "Where the motion starts and ends, by joint, rad (m if prismatic); other joints: the middle of their range."
        ),
    ] = {}
    position_rad: Annotated[
        dict[str, tuple[float, float]], about("Lowest and highest position, by joint, rad (m if prismatic).")
    ] = {}
    position_margin_rad: Annotated[
        NonNegative, about("Kept free at each end of a joint's range, rad (m if prismatic).")
    ] = 0.05
    speed_rad_s: Annotated[_ByJoint, about("Highest speed, by joint, rad/s (m/s if prismatic).")] = {}
    acceleration_rad_s2: Annotated[
        _ByJoint,
        about("Highest acceleration, by joint, rad/s²; where absent, what takes a second to the highest speed."),
    ] = {}
    jerk_rad_s3: Annotated[
        _ByJoint, about("Highest jerk, by joint, rad/s³; where absent, what takes 0.2 s to the highest acceleration.")
    ] = {}
    torque_nm: Annotated[_ByJoint, about("Highest torque of the drive, by joint, N·m (N if prismatic).")] = {}
    torque_share: Annotated[
        Positive, about("Share of the highest torque that model and friction together may ask for.")
    ] = 0.8
    link_radius_m: Annotated[
        dict[str, Positive],
        about(
            "Radius of the capsule that stands for the link which a joint moves, m; where absent and the description "
            "has no shape, that of a body with the density of water."
        ),
    ] = {}
    tool_tip_m: Annotated[
        Vec3 | None,
        about("Where the tool ends, in `[robot.tool] frame`, m; where absent, at the farthest frame of the last link."),
    ] = None
    clearance_m: Annotated[Positive, about("Least distance between links, and to the table, m.")] = 0.02
    table_z_m: Annotated[
        float, about("Height of the plane that no link but the first goes below, in the base's axes, m.")
    ] = 0.0
    workspace_min_m: Annotated[
        Vec3 | None, about("Lowest corner of a box that all links but the first stay in, in the base's axes, m.")
    ] = None
    workspace_max_m: Annotated[Vec3 | None, about("Highest corner of that box, m.")] = None
