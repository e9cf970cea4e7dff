"""``accepted.toml``: contacts that a person answers for, each by name and until a day."""

from datetime import date
from typing import Annotated

from msgspec import Meta

from collaudit.core.config.config_table import ConfigTable, Interval, Positive, Vec3, about


class Acceptance(ConfigTable, frozen=True, kw_only=True):
    """One contact that does not break the policy: what it is, who answers for it, why, and until when."""

    robot: Annotated[str | None, about("Robot of `[fleet]`, or of `--robot`; every one when absent.")] = None
    program: Annotated[
        str | None, about("Name of the log, `#` for its dates and times: other runs of the program are meant, too.")
    ] = None
    log: Annotated[
        str | None,
        about(
            "Pattern of the log's name or path, with `*`, `?` and `[…]`. One that does not begin with `/` or a scheme "
            "matches the end of a path from a folder on."
        ),
    ] = None
    sha256: Annotated[str | None, about("Hash of the one recording that is meant; needed with `time_s`.")] = None
    place_m: Annotated[
        Vec3 | None, about("Where the tool was at the peak, in the base, m; contacts within 0.2 m of it are meant.")
    ] = None
    time_s: Annotated[
        Interval | None, about("Between which times of that recording the contact lies, s from its first sample.")
    ] = None
    peak_nm: Annotated[
        dict[str, Positive],
        about("Joints that alarmed, each with its highest residual, N·m (N if prismatic); a quarter more is covered."),
    ] = {}
    lasted_s: Annotated[Positive | None, about("How long it lasted, s; one twice as long is not covered.")] = None
    reason: Annotated[str, Meta(min_length=3), about("Why it is accepted.")]
    owner: Annotated[str, Meta(min_length=1), about("Who answers for it.")]
    until: Annotated[date, about("Last day on which it counts; at most 90 days ahead.")]

    def __post_init__(self) -> None:
        if all(place is None for place in (self.program, self.log, self.place_m, self.sha256)):
            raise ValueError("nothing tells where: give program, log, place_m, or sha256")
        if not self.peak_nm and self.time_s is None:
            raise ValueError("nothing tells which contact: give peak_nm by joint, or sha256 and time_s")
        if self.time_s is not None and self.sha256 is None:
            raise ValueError("time_s needs sha256: another recording has something else at that time")

    @property
    def words(self) -> str:
        """Who accepts what, in words."""
        what = ", ".join(self.peak_nm) if self.time_s is None else "{:g} to {:g} s".format(*self.time_s)
        where = " ".join(part for part in (self.robot, self.program, self.log) if part)
        meant = f"{what} in {where}" if where else what
        return f"{meant}, accepted by {self.owner} until {self.until}: {self.reason}"


class AcceptedFile(ConfigTable, frozen=True, kw_only=True):
    """The whole file."""

    accepted: Annotated[list[Acceptance], about("Contacts that are accepted.")] = []
