"""[log]: topics, columns, units, names of a log."""

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from collaudit.core.config.config_table import ColumnPattern, ConfigTable, Positive, Vec6


class CsvConfig(ConfigTable):
    """Columns of CSV logs. `{joint}` stands for the log's joint name, `{i}` counts from 1, `{i0}` from 0."""

    time: str | int | None = Field(
        None, description="Time column: its name, or its number (from 1) in headerless files."
    )
    rate_hz: Positive | None = Field(None, description="Rows per second of a table without a time column.")
    period_s: Positive | None = Field(None, description="Seconds between the rows of a table without a time column.")
    position: ColumnPattern | None = Field(
        None,
        description="Position columns: a pattern, names, or numbers from 1. `*pos*.csv:q{i}` means the files of that "
        "name only, where several hold one quantity each.",
    )
    velocity: ColumnPattern | None = Field(None, description="Velocity columns; derived from position when absent.")
    effort: ColumnPattern | None = Field(None, description="Effort columns.")
    temperature: ColumnPattern | None = Field(
        None, description="Joint temperature columns, °C: friction is then compared with them."
    )
    joint_torque: ColumnPattern | None = Field(
        None,
        description="Columns of torque sensors behind the gears, N·m, beside `effort` of the drives: friction is then "
        "their difference.",
    )
    wrench: list[str] | list[int] | None = Field(None, description="Six columns: fx, fy, fz, mx, my, mz.")
    delimiter: str = Field("auto", description="`auto`, or the character between cells.")
    decimal: Literal["auto", ".", ","] = Field("auto", description="Decimal mark.")
    header: bool | Literal["auto"] = Field("auto", description="Whether the first line holds column names.")
    also: list[Path] = Field([], description="Further files with other quantities and the same time column.")
    labels: list[str] = Field(
        [], description="Columns that are neither 0, false nor empty while a flag or a mark of a true event holds."
    )
    phase: str | None = Field(None, description="Column that holds the phase of each row, as a number or a word.")
    run: str | int | None = Field(
        None, description="Column that numbers the runs of a table which holds several; common names are recognised."
    )

    @model_validator(mode="after")
    def _one_clock(self) -> Self:
        stated = [key for key in ("time", "rate_hz", "period_s") if getattr(self, key) is not None]
        if len(stated) > 1:
            raise ValueError(f"{' and '.join(stated)} each say when a row was taken: keep one")
        return self

    @property
    def row_period_s(self) -> float | None:
        """Seconds between rows where `rate_hz` or `period_s` states them, else None."""
        return 1.0 / self.rate_hz if self.rate_hz is not None else self.period_s


class FieldsConfig(ConfigTable):
    """Where the joint signals and the wrench stand in messages of types that no profile reads: JSON, protobuf or ROS.

    A path is dotted (`state.q`); `a,b` puts fields side by side, `joints[*].pos` takes one field of every item.
    """

    names: str | list[str] | None = Field(
        None, description="Path of the joint names, or the names themselves in the order of the values."
    )
    position: str | None = Field(
        None, description="Path of the positions; without it, `joint_states` is read by its type."
    )
    velocity: str | None = Field(None, description="Path of the velocities.")
    effort: str | None = Field(None, description="Path of the efforts.")
    temperature: str | None = Field(None, description="Path of the joints' temperatures, °C.")
    joint_torque: str | None = Field(
        None, description="Path of the torques behind the gears, N·m, beside `effort` of the drives."
    )
    stamp: str | None = Field(
        None, description="Paths of the stamp's seconds and nanoseconds: `header.stamp.sec,header.stamp.nanosec`."
    )
    wrench: str | None = Field(
        None,
        description="Path of the six numbers (N, N·m) on the topic `wrench`; without it, that is read by its type.",
    )
    wrench_stamp: str | None = Field(None, description="Paths of the wrench's stamp, as `stamp`.")


class UnitsConfig(ConfigTable):
    """Units of the log. What is not stated is taken from the message type and reported."""

    time: Literal["auto", "s", "ms", "us", "ns", "iso"] = Field("auto", description="Unit of a CSV time column.")
    position: Literal["rad", "deg"] = Field("rad", description="Unit of revolute positions (prismatic: m).")
    velocity: Literal["rad/s", "deg/s"] | None = Field(
        None, description="Unit of revolute velocities; follows `position` when absent."
    )
    effort: Literal["Nm", "A", "raw"] = Field(
        "Nm",
        description="Nm; A, which needs `torque_constant_nm_per_a`; or raw for an unknown unit: friction can then "
        "be fitted in that unit, and nothing can be judged in N·m.",
    )
    torque_constant_nm_per_a: dict[str, Positive] = Field({}, description="Joint torque per ampere, by joint, N·m/A.")
    effort_sign: dict[str, Literal[-1, 1]] = Field({}, description="-1 for a joint whose effort is inverted.")


class LimitsConfig(ConfigTable):
    """How much is read of one log. More is refused, as a small file can honestly hold very much."""

    memory_gb: Positive | None = Field(
        None,
        description="Memory that reading and judging may take, GB (10⁹ bytes), estimated from the numbers read (50 "
        "bytes each); 100 times the size of the log's files when absent, at least 1 and at most 16.",
    )
    expansion: Annotated[float, Field(ge=1)] = Field(
        100.0,
        description="Bytes that compressed files may become, as a multiple of their size; 256 MB always are read.",
    )
    chunk_mb: Positive = Field(128.0, description="Largest decompressed chunk of an MCAP file or bag, MB (10⁶ bytes).")
    messages: Annotated[int, Field(ge=1)] = Field(200_000_000, description="Most messages that are decoded.")
    columns: Annotated[int, Field(ge=1)] = Field(
        30_000, description="Most numbers in one sample or columns of a table."
    )


class LogConfig(ConfigTable):
    """Which signals of a log are meant, and in which units."""

    joint_states: str | None = Field(
        None, description="Topic of the joint states; the one matching the robot when absent."
    )
    wrench: str | None = Field(None, description="Topic of the wrist force/torque sensor.")
    wrench_frame: str | None = Field(None, description="Frame of the model the wrench is measured in.")
    wrench_sign: Literal[-1, 1] = Field(
        1,
        description="+1 if the sensor reports the force that the robot exerts; -1 if it reports the force that acts "
        "on the robot.",
    )
    wrench_bias: Literal["estimate", "calibrated"] | Vec6 = Field(
        "estimate",
        description="Zero offset of the sensor (N, N·m); `estimate`: the median before contact; or `calibrated`: "
        "offset, tool weight and centre that the friction file holds, from poses at rest.",
    )
    effort_source: Literal["auto", "motor", "joint"] = Field(
        "auto",
        description="motor: torque or current of the drives, gear friction included; joint: torque sensors behind "
        "the gears, so that little friction hides external torque at rest; auto: joint for arms known to have them.",
    )
    effort_delay_ms: float = Field(0.0, description="How much later than the motion the effort is stamped; subtracted.")
    wrench_delay_ms: float = Field(0.0, description="How much later than the motion the wrench is stamped; subtracted.")
    time: Literal["auto", "header", "log"] = Field("auto", description="Which stamp is the time of a sample.")
    joint_names: dict[str, str] = Field({}, description="Log name = model name, where they differ.")
    label_topics: list[str] = Field(
        [],
        description="Topics of flags or of marks of true events, `/topic` or `/topic:field` or `/topic:field==3`; one "
        "holds while its value is not zero, or is the one given.",
    )
    phase_topic: str | None = Field(
        None, description="Topic, `/topic` or `/topic:field`, whose value (text or whole number) is the phase."
    )
    msg_path: list[Path] = Field(
        [], description="Folders of .msg files, for types whose definitions a log does not hold (--msg-path)."
    )
    fields: FieldsConfig | None = Field(
        None, description="Where the signals of `joint_states` and `wrench` stand, when no profile reads their types."
    )
    csv: CsvConfig = Field(CsvConfig(), description="Columns of CSV logs.")
    units: UnitsConfig = Field(UnitsConfig(), description="Units of the log.")
    limits: LimitsConfig = Field(LimitsConfig(), description="How much is read of one log.")
    remote: Literal["ranges", "whole"] = Field(
        "ranges",
        description="How a log at a URL is read: of large indexed MCAPs only the parts that are needed, or all of it.",
    )
