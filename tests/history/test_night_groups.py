"""What fails in a night, by robot, cause and place, and what is gone or not tested; in a sentence, in messages."""

from __future__ import annotations

import json
from dataclasses import replace

import samples
from histories import history, night

from collaudit.core.contacts.contact_states import EarlierContact, EarlierLog
from collaudit.core.data.audit_result import AuditResult, Cause
from collaudit.core.data.detection_result import Contact, ContactScene
from collaudit.core.history.night_groups import NightGroup, night_groups
from collaudit.core.history.night_row import joint_nights
from collaudit.reports.formats.registry import summary_text
from collaudit.reports.values.entries import entry_of
from collaudit.reports.values.night import NightFacts, group_section, night_sentence

PASSED = samples.passed(500).result
JOINTS = tuple(PASSED.rule.watch)
FIRST, SECOND = JOINTS[:2]
HERE, THERE = (0.4, 0.0, 0.5), (-0.3, 0.5, 0.5)
WORN = Cause("friction", (SECOND,), "friction …", 0.9, (0.58,), ((0.55, 0.61),), "fit again", speaks=True)
TONIGHT = night(5)


def touch(joint: str, place: tuple[float, float, float], onset: float = 42.0, **state: object) -> Contact:
    scene = ContactScene(onset, ((0.0, 0.0, 0.0), place), "tool0", None, {})
    one = Contact(onset, onset, onset + 0.3, (joint,), "", "", None, "undecided", (), None, scene, {joint: 9.0})
    return replace(one, **state)  # type: ignore[arg-type]


def log(name: str, *contacts: Contact, causes: tuple[Cause, ...] = (), verdict: str = "") -> AuditResult:
    about = replace(PASSED.log, name=name, start=f"{TONIGHT}T14:00:00Z")
    decided = verdict or ("fail" if contacts else "pass")
    return replace(PASSED, log=about, contacts=contacts, causes=causes, verdict=decided)  # type: ignore[arg-type]


def before(number: int, program: str, *contacts: tuple[str, tuple[float, float, float]]) -> EarlierLog:
    found = tuple(EarlierContact(night(number), program, {joint: 9.0}, place) for joint, place in contacts)
    return EarlierLog("B", night(number), program, found)


def groups(*logs: AuditResult, past: tuple[EarlierLog, ...] = ()) -> tuple[NightGroup, ...]:
    robots = {one.log.name: one.log.name[0] for one in logs}
    worn = [
        replace(row, log=f"{k}", log_sha256=f"{k}{row.night}", friction_nm=(row.friction_nm or 0.0) + 0.01 * k)
        for k in range(3)
        for row in history("A", 6, (SECOND,), lambda number, _: 8.0 if number < 4 else 12.6 + 0.01 * number)
    ]
    return night_groups(logs, robots, past, TONIGHT, joint_nights(worn))


WORN_LOGS = [log(f"A/run{k}.csv", touch(SECOND, HERE), touch(SECOND, THERE), causes=(WORN,)) for k in range(9)]
PUSHED = [log("B/a.csv", touch(FIRST, HERE)), log("B/b.csv", touch(FIRST, HERE, 1902.0))]


def test_a_night_is_explained() -> None:
    found = groups(*WORN_LOGS, *PUSHED)
    assert [(one.robot, one.cause, one.state, len(one.logs)) for one in found] == [
        ("A", "friction", "known", 9),
        ("B", "", "new", 2),
    ]
    said = night_sentence([entry_of(one) for one in (*WORN_LOGS, *PUSHED)], found)
    assert said == (
        f"11 of 11 logs judged; 11 break the policy. Robot A: friction of '{SECOND}' is 58 % above that of the fitted "
        f"logs (± 3 %) since {night(4)}; 9 logs do not pass by it; no contact on another joint. Robot B: 2 new "
        f"contacts at 14:00:42 and 14:31:42, same place ({FIRST})."
    )


def test_a_contact_that_the_cause_does_not_explain_stands_by_itself() -> None:
    other = log("A/run.csv", touch(SECOND, HERE), touch(FIRST, THERE), causes=(WORN,))
    found = groups(other)
    assert [(one.cause, one.joints) for one in found] == [("friction", (SECOND,)), ("", (FIRST,))]
    assert "no contact on another joint" not in night_sentence([entry_of(other)], found)
    silent = replace(WORN, speaks=False)
    assert [one.cause for one in groups(log("A/run.csv", touch(SECOND, HERE), causes=(silent,)))] == [""]


def test_contacts_at_many_places_are_said_together() -> None:
    """Seventeen clauses in the first sentence of a night tell nobody anything."""
    places = [(0.1 * k - 0.8, 0.3 * (k % 3), 0.5) for k in range(17)]
    touched = log("B/a.csv", *(touch(FIRST, place, 6.0 + k) for k, place in enumerate(places)))
    said = night_sentence([entry_of(touched)], groups(touched))
    assert f"17 new contacts at 17 places in 1 log, the first at 14:00:06 ({FIRST})." in said
    known = log("B/b.csv", touch(SECOND, HERE, state="known", known_since=night(0), known_nights=3))
    said = night_sentence([entry_of(one) for one in (touched, known)], groups(touched, known))
    assert "17 new contacts at 17 places" in said and "1 known contact at 14:00:42" in said


def test_every_state() -> None:
    seen = {"known_since": night(0), "known_nights": 3}
    came_and_went = tuple(
        before(k, "B/a.csv", *([(FIRST, HERE)] if k in (0, 2) else []), (SECOND, THERE)) for k in range(4)
    )
    lost = before(3, "B/c.csv", (FIRST, (0.0, 0.9, 0.1)))
    tonight = [
        log("B/a.csv", touch(FIRST, HERE, state="back", **seen)),
        log("B/d.csv", touch(FIRST, (0.9, 0.9, 0.9), state="accepted"), verdict="pass"),
    ]
    found = {(one.state, one.joints[0]): one for one in groups(*tonight, past=(*came_and_went, lost))}
    assert set(found) == {("flaky", FIRST), ("gone", SECOND), ("not tested", FIRST), ("accepted", FIRST)}
    gone = found["gone", SECOND]
    assert (gone.since, gone.nights, gone.logs) == (night(0), 4, ("B/a.csv",))
    assert found["not tested", FIRST].logs == ("B/c.csv",), "its program was not judged tonight"
    unjudged = groups(log("B/a.csv", verdict="not_judged"), past=came_and_went)
    assert {one.state for one in unjudged} == {"not tested"}, "not judged is not gone"


def test_a_night_in_a_message() -> None:
    logs = [*WORN_LOGS, log("B/a<b&c.csv", touch(FIRST, HERE))]
    facts = NightFacts(
        groups=groups(*logs), reports={"B/a<b&c.csv": "B_a b/report.html"}, link="https://ci.example/night/"
    )
    text = summary_text(logs, "text", (), facts)
    assert text.startswith(f"FAIL, {TONIGHT}: 10 of 10 logs judged; ") and len(text.split()) < 250
    assert "https://ci.example/night/B_a%20b/report.html" in text
    slack = json.loads(summary_text(logs, "slack-json", (), facts))
    body = "\n".join(block["text"]["text"] for block in slack["blocks"])
    assert "<https://ci.example/night/B_a%20b/report.html|FAIL B/a&lt;b&amp;c.csv: " in body
    assert all(block["type"] == "section" and len(block["text"]["text"]) <= 3000 for block in slack["blocks"])
    many = [log(f"B/{k:04}{'x' * 200}.csv", touch(FIRST, HERE)) for k in range(60)]
    cut = summary_text(many, "text")
    assert "50 more logs" in cut and len(json.loads(summary_text(many, "slack-json"))["blocks"]) <= 50


def test_groups_are_a_table() -> None:
    rows = group_section(groups(*WORN_LOGS, *PUSHED)).records
    assert rows[0]["logs"] == "A/run0.csv, A/run1.csv, A/run2.csv and 6 more"
    assert rows[1] == {
        "state": "new",
        "robot": "B",
        "what": f"contact of {FIRST}, tool at (0.40, 0.00, 0.50) m",
        "since": "tonight",
        "nights": "1",
        "logs": "B/a.csv, B/b.csv",
    }
