"""Forces beside the user's limits, and what cannot be concluded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
import samples

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.detection_result import Contact, ContactForce
from collaudit.core.errors import ConfigError
from collaudit.reports.page.matter_pages import body_regions_html
from collaudit.reports.sections.body_region_sections import CANNOT_BE_CONCLUDED, body_region_section, read_limits
from collaudit.reports.terminal.command_texts import body_region_text

LIMITS = """
source = "our own measurement of 3 March"
[[region]]
name = "hand"
quasi_static_n = 100
transient_n = 200
"""


@pytest.fixture(scope="module")
def audit() -> Audit:
    return samples.failed(5000)


def _with_force(audit: Audit, low: float, high: float | None, blind: int) -> Audit:
    unseen = ((0.0, 0.0, 1.0),) * blind
    force = ContactForce("tool", None, (1.0, None, None), high, (low, high), unseen, 0.1)
    contact = Contact(1.0, 1.1, 1.5, samples.JOINTS[:1], "forearm", "", force, "undecided", ())
    return replace(audit, result=replace(audit.result, contacts=(contact,)))


@pytest.mark.parametrize(
    ("low", "high", "blind", "beside"),
    [
        (10.0, 50.0, 0, "the interval is below"),
        (50.0, 150.0, 0, "the interval reaches above"),
        (120.0, 150.0, 0, "the whole interval is above"),
        (120.0, None, 1, "the whole interval is above"),
        (10.0, None, 1, "not determinable: some directions are not felt"),
    ],
)
def test_a_force_beside_a_limit(
    audit: Audit, tmp_path: Path, low: float, high: float | None, blind: int, beside: str
) -> None:
    (tmp_path / "limits.toml").write_text(LIMITS)
    result = _with_force(audit, low, high, blind).result
    rows = body_region_section(result, read_limits(tmp_path / "limits.toml")).rows
    assert [row[-2] for row in rows] == ["100 N quasi-static", "200 N transient"]
    assert rows[0][-1] == beside
    text = body_region_text([result], read_limits(tmp_path / "limits.toml"), 80)
    assert CANNOT_BE_CONCLUDED in " ".join(text.split()) and "3 March" in text


@pytest.mark.parametrize(
    "text",
    [
        "",
        'source = "x"',
        '[[region]]\nname = "a"\ntransient_n = 1',
        'source = "x"\n[[region]]\nname = "a"',
        'source = "x"\n[[region]]\nname = "a"\ntransient_n = -1',
        'source = "x"\n[[region]]\nname = "a"\ntransient_n = nan',
        'source = "x"\n[[region]]\nname = "a"\ntransient = 1',
    ],
)
def test_a_file_of_limits_says_whose_they_are_and_nothing_unknown(tmp_path: Path, text: str) -> None:
    (tmp_path / "limits.toml").write_text(text)
    with pytest.raises(ConfigError):
        read_limits(tmp_path / "limits.toml")


def test_the_page_of_forces_says_what_cannot_be_concluded(audit: Audit, tmp_path: Path) -> None:
    (tmp_path / "limits.toml").write_text(LIMITS)
    limits = read_limits(tmp_path / "limits.toml")
    text = body_regions_html([_with_force(audit, 300.0, 400.0, 0).result, samples.not_judged().result], limits)
    assert "the whole interval is above" in text
    assert "no evidence that the limit was kept" in text
    assert "not judged</bdi></p>" in text
