"""[log]: topics, columns, units, names of a log."""

from pathlib import Path
from typing import Annotated, Literal

from msgspec import Meta

from collaudit.core.config.config_table import (
    ColumnPattern,
    ConfigTable,
    ListOfColumns,
    NonNegative,
    Positive,
    Vec6,
    about,
)


class CsvConfig(ConfigTable, frozen=True, kw_only=True):
    """Columns of CSV logs. `{joint}` stands for the log's joint name, `{i}` counts from 1, `{i0}` from 0."""

    time: Annotated[
        str | int | Annotated[list[str | int], Meta(min_length=2, max_length=3)] | None,
        about(
            "Time column: its name, or its number (from 1) in headerless files; or the columns that make a time "
            'together: seconds and nanoseconds, `["Date", "Time"]`, or these and milliseconds.'
        ),
    ] = None
    rate_hz: Annotated[Positive | None, about("Rows per second of a table without a time column.")] = None
    position: Annotated[
        ColumnPattern | None,
        about(
            "Position columns: a pattern, names, or numbers from 1. `*pos*.csv:q{i}` means the files of that "
            "name only, where several hold one quantity each."
        ),
    ] = None
    velocity: Annotated[ColumnPattern | None, about("Velocity columns; derived from position when absent.")] = None
    effort: Annotated[ColumnPattern | None, about("Effort columns.")] = None
    temperature: Annotated[
        ColumnPattern | None, about("Joint temperature columns, °C: friction is then compared with them.")
    ] = None
    joint_torque: Annotated[
        ColumnPattern | None,
        about(
            "Columns of torque sensors behind the gears, N·m, beside `effort` of the drives: friction is then "
            "their difference."
        ),
    ] = None
    wrench: Annotated[ListOfColumns | None, about("Six columns: fx, fy, fz, mx, my, mz.")] = None
    delimiter: Annotated[str, about("`auto`, or the character between cells.")] = "auto"
    decimal: Annotated[Literal["auto", ".", ","], about("Decimal mark.")] = "auto"
    header: Annotated[
        bool | Annotated[int, Meta(ge=1)] | Literal["auto"],
        about("Whether the first line holds column names; or the number of the line that does."),
    ] = "auto"
    units_row: Annotated[
        bool | Literal["auto"], about("Whether a row with the units of the columns stands below their names.")
    ] = "auto"
    comment: Annotated[
        list[str], about("Beginnings of lines that are no rows, such as `Samples:`; # and % are known.")
    ] = []
    run: Annotated[
        str | int | None,
        about("Column that numbers the runs of a table which holds several; common names are recognised."),
    ] = None

    def __post_init__(self) -> None:
        self.check_kinds("position", "velocity", "effort", "temperature", "joint_torque", "wrench")
        if self.time is not None and self.rate_hz is not None:
            raise ValueError("time and rate_hz each say when a row was taken: keep one")

    @property
    def lines_before(self) -> int:
        """Lines of the file before the line of column names, as far as it is stated."""
        return 0 if isinstance(self.header, bool | str) else self.header - 1

    @property
    def row_period_s(self) -> float | None:
        """Seconds between rows where `rate_hz` states them, else None."""
        return None if self.rate_hz is None else 1.0 / self.rate_hz


class FieldsConfig(ConfigTable, frozen=True, kw_only=True):
    """Where the joint signals and the wrench stand in messages of types that no profile reads: JSON, protobuf or ROS.

    A path is dotted (`state.q`); `a,b` puts fields side by side, `joints[*].pos` takes one field of every item.
    """

    names: Annotated[
        str | list[str] | None, about("Path of the joint names, or the names themselves in the order of the values.")
    ] = None
    position: Annotated[str | None, about("Path of the positions; without it, `joint_states` is read by its type.")] = (
        None
    )
    velocity: Annotated[str | None, about("Path of the velocities.")] = None
    effort: Annotated[str | None, about("Path of the efforts.")] = None
    temperature: Annotated[str | None, about("Path of the joints' temperatures, °C.")] = None
    joint_torque: Annotated[
        str | None, about("Path of the torques behind the gears, N·m, beside `effort` of the drives.")
    ] = None
    stamp: Annotated[
        str | None,
        about("Paths of the stamp's seconds and nanoseconds, in both: `header.stamp.sec,header.stamp.nanosec`."),
    ] = None
    wrench: Annotated[
        str | None,
        about("Path of the six numbers (N, N·m) on the topic `wrench`; without it, that is read by its type."),
    ] = None


class UnitsConfig(ConfigTable, frozen=True, kw_only=True):
    """Units of the log. What is not stated is taken from the message type and reported."""

    time: Annotated[Literal["auto", "s", "ms", "us", "ns", "iso"], about("Unit of a CSV time column.")] = "auto"
    position: Annotated[Literal["rad", "deg"], about("Unit of revolute positions.")] = "rad"
    velocity: Annotated[
        Literal["rad/s", "deg/s"] | None, about("Unit of revolute velocities; follows `position` when absent.")
    ] = None
    length: Annotated[
        Literal["m", "mm"], about("Unit of prismatic positions; their velocities are in it per second.")
    ] = "m"
    effort: Annotated[
        Literal["Nm", "A", "mA", "percent", "permille", "raw"],
        about(
            "A and mA need `torque_constant_nm_per_a`, percent and permille `rated_torque_nm`; raw is an "
            "unknown unit: friction can be fitted in it, and nothing judged."
        ),
    ] = "Nm"
    torque_constant_nm_per_a: Annotated[dict[str, Positive], about("Joint torque per ampere, by joint, N·m/A.")] = {}
    rated_torque_nm: Annotated[
        dict[str, Positive],
        about(
            "Rated torque by joint, N·m (prismatic: N): that of its drive times the ratio of its gear. CiA 402 "
            "drives state theirs in object 6076h, mN·m."
        ),
    ] = {}
    effort_sign: Annotated[dict[str, Literal[-1, 1]], about("-1 for a joint whose effort is inverted.")] = {}

    @property
    def has_constants(self) -> bool:
        """Whether constants of the drives make N·m of the efforts."""
        return bool(self.torque_constant_nm_per_a or self.rated_torque_nm)


class LogConfig(ConfigTable, frozen=True, kw_only=True):
    """Which signals of a log are meant, and in which units."""

    joint_states: Annotated[
        str | None,
        about(
            "Topic of the joint states; when absent the one with most of the robot's joints, measured, with efforts."
        ),
    ] = None
    efforts: Annotated[
        str | None,
        about("Topic of the efforts, if they are not on that of the positions: joined by time and names."),
    ] = None
    rate_hz: Annotated[
        Positive | None,
        about("Messages of the joint states per second, where no stamp tells when they were taken."),
    ] = None
    wrench: Annotated[str | None, about("Topic of the wrist force/torque sensor.")] = None
    wrench_frame: Annotated[str | None, about("Frame of the model the wrench is measured in.")] = None
    wrench_sign: Annotated[
        Literal[-1, 1],
        about("+1: the force that the robot exerts; -1: the force that acts on it."),
    ] = 1
    wrench_bias: Annotated[
        Literal["estimate", "calibrated"] | Vec6,
        about(
            "Zero offset of the sensor (N, N·m); `estimate`: the median before contact; or `calibrated`: "
            "offset, tool weight and centre that the friction file holds, from poses at rest."
        ),
    ] = "estimate"
    effort_kind: Annotated[
        Literal["auto", "motor-current", "motor-torque", "joint-torque", "gravity-compensated", "external"],
        about(
            "motor-current, motor-torque: of the drives, gear friction included; joint-torque: sensors "
            "behind the gears; gravity-compensated: of the drives, less gravity by the controller; external: "
            "an estimate of external torque, which is not judged; auto: joint-torque for arms known to have "
            "sensors, else motor-torque."
        ),
    ] = "auto"
    from_s: Annotated[
        NonNegative | None, about("Where the part that is read begins, s from the log's first sample (--from).")
    ] = None
    to_s: Annotated[Positive | None, about("Where it ends (--to).")] = None
    memory_gb: Annotated[
        Positive | None,
        about("Memory that reading and judging may take, GB; 100 times the files' size when absent, in 1 to 16."),
    ] = None
    effort_delay_ms: Annotated[float, about("How much later than the motion the effort is stamped; subtracted.")] = 0.0
    wrench_delay_ms: Annotated[float, about("How much later than the motion the wrench is stamped; subtracted.")] = 0.0
    time: Annotated[Literal["auto", "header", "log"], about("Which stamp is the time of a sample.")] = "auto"
    joint_names: Annotated[
        dict[str, str],
        about("Log name = model name, where they differ; it wins over a joint of the log that is called so."),
    ] = {}
    labels: Annotated[
        list[str],
        about(
            "Flags or marks of true events: topics, `/topic` or `/topic:field` or `/topic:field==3`, or columns of a "
            "table. One holds while its value is not zero, false or empty, or is the one given."
        ),
    ] = []
    phase: Annotated[
        str | None,
        about("Topic, `/topic` or `/topic:field`, or column, whose value (text or whole number) is the phase."),
    ] = None
    msg_path: Annotated[
        list[Path], about("Folders of .msg files, for types whose definitions a log does not hold.")
    ] = []
    fields: Annotated[
        FieldsConfig | None,
        about("Where the signals of `joint_states` and `wrench` stand, when no profile reads their types."),
    ] = None
    csv: Annotated[CsvConfig, about("Columns of CSV logs.")] = CsvConfig()
    units: Annotated[UnitsConfig, about("Units of the log.")] = UnitsConfig()
