"""Limits of force by body region, from a file that the user supplies, and estimated forces beside them: no verdict."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Annotated

from msgspec import Meta, ValidationError

from collaudit.core.config.config_table import ConfigTable, Positive
from collaudit.core.data.audit_result import AuditResult
from collaudit.core.data.detection_result import ContactForce
from collaudit.core.errors import ConfigError, similar_file
from collaudit.core.small_files import parse_toml, read_small
from collaudit.reports.sections.event_sections import contact_section
from collaudit.reports.sections.section import Section
from collaudit.reports.values.words import nothing_judged

#: What stands beside every table of forces and limits.
CANNOT_BE_CONCLUDED = (
    "This is information and no assessment. A joint residual cannot tell which part of a body was touched, over what "
    "area and with what pressure, whether it was clamped, or how high the force was in the first milliseconds, which "
    "filter and persistence smooth away. Directions that the joints do not feel are not in the estimate. A force that "
    "reads below a limit is no evidence that the limit was kept: that takes a measurement of force and pressure."
)


class BodyRegion(ConfigTable, frozen=True, kw_only=True):
    """A region of the body with the forces somebody allows there, N; None where the file states none."""

    name: str
    quasi_static_n: Positive | None = None
    transient_n: Positive | None = None

    def __post_init__(self) -> None:
        """A limit, at least."""
        if self.quasi_static_n is None and self.transient_n is None:
            raise ValueError("states no limit")


class BodyLimits(ConfigTable, frozen=True, kw_only=True):
    """Limits as the user's file states them, and where they are from."""

    source: Annotated[str, Meta(pattern=r"\S")]
    region: Annotated[tuple[BodyRegion, ...], Meta(min_length=1)]


_EXAMPLE = 'source = "where the numbers are from", then [[region]] with name, quasi_static_n and transient_n'


def read_limits(path: Path) -> BodyLimits:
    """Read a file of limits.

    Args:
        path: TOML with ``source`` and tables ``[[region]]``.

    Raises:
        ConfigError: it cannot be read, or does not say what is needed.
    """
    try:
        data = parse_toml(read_small(path).decode())
    except FileNotFoundError as error:
        raise ConfigError("there is no such file of limits", where=str(path), hint=similar_file(path)) from error
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise ConfigError("the file of limits cannot be read", where=str(path), found=str(error)) from error
    try:
        return BodyLimits.of(data)
    except ValidationError as error:
        text = "the file does not state limits as it should"
        raise ConfigError(text, where=str(path), found=str(error), expected=_EXAMPLE) from error


def body_region_section(result: AuditResult, limits: BodyLimits) -> Section:
    """Every contact of a log beside every limit of the file: onset, joints, force, region, limit, and how they lie."""
    rows = []
    for contact, record in zip(result.contacts, contact_section(result).records, strict=True):
        shown = (record["onset"], record["joints"], record["force (95 %)"])
        for region in limits.region:
            for kind, limit in (("quasi-static", region.quasi_static_n), ("transient", region.transient_n)):
                if limit is not None:
                    rows.append((*shown, region.name, f"{limit:g} N {kind}", _against_limit(contact.force, limit)))
    head = ("onset", "joints", "estimated force (95 %)", "region", "limit", "force beside limit")
    none = "not judged" if nothing_judged(result) else "no contact was found in the time that was judged"
    return Section(result.log.name, head, tuple(rows), () if rows else (none,))


def _against_limit(force: ContactForce | None, limit_n: float) -> str:
    """How the interval of a force lies to a limit; without an interval nothing is said."""
    if force is None:
        return "force not determinable"
    low, high = force.size_ci95_n
    if low > limit_n:
        return "the whole interval is above"
    if high is None:
        return "not determinable: some directions are not felt"
    return "the interval reaches above" if high > limit_n else "the interval is below"
