"""Two runs side by side, and forces beside the user's limits: gained, lost, not judged, what cannot be concluded."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import samples
from jsonschema import Draft202012Validator
from user_guide.result_schemas import result_schema

from collaudit.core.data.audit_result import Audit
from collaudit.core.data.detection_result import Contact, ContactForce
from collaudit.core.data.sensitivity_result import AskedTorque, JointSensitivity, Sensitivity
from collaudit.core.data.signals import State
from collaudit.core.errors import ConfigError
from collaudit.reports.files.json_files import json_text
from collaudit.reports.files.limits_file import read_limits
from collaudit.reports.page.comparison_page import body_regions_html, comparison_html
from collaudit.reports.sections.comparison_sections import CANNOT_BE_CONCLUDED, body_region_section
from collaudit.reports.terminal.command_texts import body_region_text, comparison_text
from collaudit.reports.values.comparison import compare

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


def _without_contacts(audit: Audit) -> Audit:
    return replace(audit, result=replace(audit.result, collisions=(), contacts=(), verdict="pass"))


def test_a_run_beside_itself_differs_in_nothing(audit: Audit) -> None:
    found = compare(audit, audit)
    assert found.same_log and found.kept == len(audit.result.contacts)
    assert (found.contacts, found.settings, found.findings) == ((), (), ())
    assert all(change.differs in (False, None) for change in found.friction)
    assert "nothing differs" in comparison_text(found, 80)


def test_contacts_are_gained_and_lost(audit: Audit) -> None:
    lost = compare(audit, _without_contacts(audit))
    assert {change.change for change in lost.contacts} == {"lost"}
    assert len(lost.contacts) == len(audit.result.contacts) and lost.kept == 0
    assert lost.contacts[0].judged == 1.0
    gained = compare(_without_contacts(audit), audit)
    assert {change.change for change in gained.contacts} == {"gained"}
    assert f"0 in both, {len(gained.contacts)} gained, 0 lost" in comparison_text(gained)


def test_a_contact_lost_in_time_that_was_not_judged_says_nothing(audit: Audit) -> None:
    other = _without_contacts(audit)
    blind = replace(other.signals, state=np.full_like(other.signals.state, State.NO_MODEL))
    found = compare(audit, replace(other, signals=blind))
    assert {change.judged for change in found.contacts} == {0.0}
    (words,) = {change.why for change in found.contacts}
    assert words in comparison_text(found)
    resting = replace(other.signals, state=np.full_like(other.signals.state, State.FRICTION_INTERVAL))
    assert {change.why for change in compare(audit, replace(other, signals=resting)).contacts} == {words}
    assert {change.why for change in compare(audit, other).contacts} != {words}


def test_contacts_of_different_logs_are_listed_and_not_matched(audit: Audit) -> None:
    other = replace(audit, result=replace(audit.result, log=replace(audit.result.log, sha256="f" * 64)))
    found = compare(audit, other)
    assert found.kept is None and {change.change for change in found.contacts} == {"before", "after"}


def test_friction_differs_only_where_intervals_are_apart(audit: Audit) -> None:
    joint, fit = next((j, f) for j, f in audit.result.friction.items() if any(f.ci95.values()))
    name, (low, high) = next((n, b) for n, b in fit.ci95.items() if b is not None and None not in b)
    for share, differs in ((0.5, False), (2.0, True)):
        shift = share * (high - low)
        moved = replace(
            fit,
            parameters={**fit.parameters, name: fit.parameters[name] + shift},
            ci95={**fit.ci95, name: (low + shift, high + shift)},
        )
        other = replace(audit, result=replace(audit.result, friction={**audit.result.friction, joint: moved}))
        changes = {(c.joint, c.parameter): c.differs for c in compare(audit, other).friction}
        assert changes[joint, name] is differs


def test_settings_and_versions_that_differ(audit: Audit) -> None:
    rule = replace(audit.result.rule, n=9, gamma_nm={**audit.result.rule.gamma_nm, samples.JOINTS[0]: 7.5})
    found = compare(audit, replace(audit, result=replace(audit.result, rule=rule)))
    assert {c.what: c.after for c in found.settings} == {"n": "9", f"γ of {samples.JOINTS[0]}, N·m": "7.5"}


def test_a_pass_with_exclusions_stays_one_and_sizes_asked_for_are_settings(audit: Audit) -> None:
    asked = [JointSensitivity((), 9.0, 10.0, 10.0, AskedTorque(size, 0.5, 5.0, 5.0, 1.0)) for size in (8.0, 20.0)]
    joint = samples.JOINTS[0]
    sides = [
        replace(
            audit, result=replace(audit.result, verdict="pass", exclusions=("x",), sensitivity=Sensitivity({joint: s}))
        )
        for s in asked
    ]
    found = compare(*sides)
    assert {c.what: (c.before, c.after) for c in found.settings} == {
        f"torque that must alarm on {joint}, N·m": ("8", "20")
    }
    text = comparison_text(found)
    assert text.count("PASS, WITH EXCLUSIONS") == 2


def test_the_comparison_keeps_to_its_schema(audit: Audit) -> None:
    text = json_text(compare(audit, _without_contacts(audit)))
    Draft202012Validator(result_schema("comparison")).validate(json.loads(text))


def _with_force(audit: Audit, low: float, high: float, blind: int) -> Audit:
    unseen = ((0.0, 0.0, 1.0),) * blind
    force = ContactForce("tool", (high, 0.0, 0.0), (1.0, None, None), high, (low, high), unseen, 0.1)
    contact = Contact(1.0, 1.1, 1.5, samples.JOINTS[:1], "forearm", "", force, "undecided", ())
    return replace(audit, result=replace(audit.result, contacts=(contact,)))


@pytest.mark.parametrize(
    ("low", "high", "blind", "beside"),
    [
        (10.0, 50.0, 0, "the interval is below"),
        (50.0, 150.0, 0, "the interval reaches above"),
        (120.0, 150.0, 0, "the whole interval is above"),
        (120.0, 150.0, 1, "the whole interval is above"),
        (10.0, 50.0, 1, "not determinable: some directions are not felt"),
    ],
)
def test_a_force_beside_a_limit(audit: Audit, tmp_path: Path, low: float, high: float, blind: int, beside: str) -> None:
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


def test_the_page_of_a_comparison_holds_what_the_terminal_shows_and_nothing_runs_in_it(audit: Audit) -> None:
    text = comparison_html(compare(audit, samples.hostile()))
    assert "default-src 'none'" in text and "script-src 'none'" in text
    assert "Contacts: " in text
    assert "Friction" in text and "Residual level" in text
    assert "<script" not in text.partition("</style>")[2]
    assert comparison_html(compare(audit, samples.hostile())) == text


def test_the_page_of_forces_says_what_cannot_be_concluded(audit: Audit, tmp_path: Path) -> None:
    (tmp_path / "limits.toml").write_text(LIMITS)
    limits = read_limits(tmp_path / "limits.toml")
    text = body_regions_html([_with_force(audit, 300.0, 400.0, 0).result, samples.not_judged().result], limits)
    assert "the whole interval is above" in text
    assert "no evidence that the limit was kept" in text
    assert "not judged</bdi></p>" in text
