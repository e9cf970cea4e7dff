"""A contact is known, back or accepted by robot, program or place, joints and size; and by nothing less."""

from __future__ import annotations

import random
from dataclasses import replace
from datetime import date, timedelta

import pytest

from collaudit.core.config.accepted import Acceptance
from collaudit.core.config.schema_judging import PolicyConfig
from collaudit.core.contacts.contact_states import EarlierContact, Precedents, with_states
from collaudit.core.data.audit_result import Coverage
from collaudit.core.data.detection_result import Contact, ContactScene
from collaudit.core.data.sensitivity_result import Sensitivity
from collaudit.core.verdict.verdict import Evidence, decide, uncounted_texts

TODAY, PEAKS, HERE = date(2026, 6, 15), {"j2": 12.0, "j3": 5.0}, (0.5, 0.0, 0.3)


def contact(peaks=PEAKS, place=HERE, lasted=0.3, onset=3.0) -> Contact:
    scene = ContactScene(onset, ((0.0, 0.0, 0.0), place), "tool0", None, {})
    return Contact(onset, onset, onset + lasted, tuple(peaks), "", "", None, "undecided", (), None, scene, peaks)


def known(**changes: object) -> Precedents:
    stated = {"robot": "A", "log": "A/cell/pick_2026-06-15.csv", "path": "cell/pick_2026-06-15.csv", "today": TODAY}
    return Precedents(**{**stated, "night": "2026-06-15", **changes})  # type: ignore[arg-type]


def judged(one: Contact, precedents: Precedents, sha256: str = "abc") -> Contact:
    return with_states([one], precedents, sha256, None)[0]


def earlier(night="2026-06-10", program="A/cell/pick_#.csv", peaks=PEAKS, place=HERE) -> EarlierContact:
    return EarlierContact(night, program, peaks, place)


@pytest.mark.parametrize(
    ("before", "state"),
    [
        (earlier(), "known"),
        (earlier(place=(0.9, 0.0, 0.3)), "new"),  # elsewhere in the program
        (earlier(place=None), "known"),  # the program is the same
        (earlier(program="A/cell/place.csv"), "known"),  # the place is the same
        (earlier(program="A/cell/place.csv", place=(0.9, 0.0, 0.3)), "new"),
        (earlier(program="A/cell/place.csv", place=None), "new"),
        (earlier(peaks={"j2": 9.0, "j3": 5.0}), "new"),  # clearly harder now
        (earlier(peaks={"j2": 11.0, "j3": 4.5}), "known"),
        (earlier(peaks={"j2": 40.0}), "known"),  # weaker now
        (earlier(peaks={"j5": 12.0}), "new"),
        (earlier(peaks={"j2": 11.0, "j5": 30.0}), "new"),  # the strongest joint is another
    ],
)
def test_what_is_known_again(before: EarlierContact, state: str) -> None:
    assert judged(contact(), known(contacts=(before,))).state == state


@pytest.mark.parametrize(("night", "state"), [("2026-06-14", "known"), ("2026-06-15", "new"), ("2026-06-20", "new")])
def test_nights_of_a_store_are_known_to_later_ones_only(night: str, state: str) -> None:
    before = replace(earlier(night=night), stored=True)
    assert judged(contact(), known(contacts=(before,))).state == state
    assert judged(contact(), known(contacts=(earlier(night=night),))).state == "known", "a baseline is named as earlier"


def test_since_when_and_back() -> None:
    seen = tuple(earlier(night=f"2026-06-{day:02}") for day in (3, 5, 5))
    one = judged(contact(), known(contacts=seen, nights=("2026-06-03", "2026-06-05", "2026-06-15")))
    assert (one.state, one.known_since, one.known_nights) == ("known", "2026-06-03", 2)
    one = judged(contact(), known(contacts=seen, nights=("2026-06-03", "2026-06-05", "2026-06-09")))
    assert one.state == "back" and "2026-06-05" in one.state_text


def test_a_harder_one_is_new_and_still_tells_since_when() -> None:
    one = judged(contact(), known(contacts=(earlier(peaks={"j2": 9.0, "j3": 5.0}),)))
    assert (one.state, one.known_since, one.known_nights) == ("new", "2026-06-10", 1)
    assert one.state_text == "harder than since 2026-06-10 (1 night)"


def test_the_age_of_contacts_over_60_nights() -> None:
    """Eight sources in three programs, each with its place, joints, size and habit; since when, and how many nights."""
    right = asked = 0
    for seed in range(5):
        rng = random.Random(seed)
        sources = [_source(rng) for _ in range(8)]
        history: list[EarlierContact] = []
        truth: dict[int, list[str]] = {}
        for number in range(60):
            night = (date(2026, 6, 1) + timedelta(days=number)).isoformat()
            tonight = []
            for k, (program, peaks, place, first, habit) in enumerate(sources):
                if number < first or rng.random() > habit:
                    continue
                moved = tuple(x + rng.gauss(0.0, 0.03) for x in place)
                one = contact({joint: peak * rng.gauss(1.0, 0.1) for joint, peak in peaks.items()}, moved)
                name = program.replace("#", night)
                got = judged(one, known(log=name, path=name, night=night, contacts=tuple(history)))
                nights = truth.get(k, [])
                right += (got.known_since, got.known_nights) == (nights[0] if nights else None, len(nights))
                asked += 1
                tonight.append((k, EarlierContact(night, program, one.peak_nm, moved)))
            for k, one in tonight:
                truth.setdefault(k, []).append(one.night)
                history.append(one)
    assert asked > 800 and right >= 0.98 * asked


def _source(rng: random.Random) -> tuple[str, dict[str, float], tuple[float, ...], int, float]:
    """Program, peaks by joint, place, first night, and on which share of the nights it is there."""
    joints = rng.sample(["j1", "j2", "j3", "j4", "j5", "j6"], rng.choice((1, 1, 2, 3)))
    place = tuple(rng.uniform(-0.8, 0.8) for _ in range(3))
    peaks = {joint: rng.uniform(5.0, 30.0) for joint in joints}
    return f"A/p{rng.randrange(3)}_#.csv", peaks, place, rng.randrange(50), rng.choice((1.0, 0.9, 0.5, 0.2))


def entry(**changes: object) -> Acceptance:
    stated = {"robot": "A", "program": "A/cell/pick_#.csv", "place_m": HERE, "peak_nm": PEAKS, "lasted_s": 0.3}
    words = {"reason": "by hand", "owner": "A. Lee", "until": date(2026, 7, 1)}
    return Acceptance(**{**stated, **words, **changes})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("one", "by", "state"),
    [
        (contact(), entry(), "accepted"),
        (contact(peaks={"j2": 14.9}), entry(), "accepted"),
        (contact(peaks={"j2": 15.1}), entry(), "new"),
        (contact(peaks={"j2": 12.0, "j4": 1.0}), entry(), "new"),
        (contact(place=(0.5, 0.25, 0.3)), entry(), "new"),
        (contact(lasted=0.7), entry(), "new"),
        (contact(), entry(robot="B"), "new"),
        (contact(), entry(program="A/cell/place_#.csv"), "new"),
        (contact(), entry(program=None, log="cell/pick_*"), "accepted"),
        (contact(), entry(program=None, log="hall/*"), "new"),
        (contact(), entry(until=date(2026, 6, 14)), "new"),
        (contact(), entry(until=date(2026, 6, 15)), "accepted"),
        (contact(), entry(until=date(2026, 9, 13)), "accepted"),
        (contact(), entry(until=date(2026, 9, 14)), "new"),
        (contact(), entry(peak_nm={}, sha256="abc", time_s=(2.9, 3.4)), "accepted"),
        (contact(), entry(peak_nm={}, sha256="abd", time_s=(2.9, 3.4)), "new"),
        (contact(onset=3.3), entry(peak_nm={}, sha256="abc", time_s=(2.9, 3.4)), "new"),
    ],
)
def test_what_an_entry_covers(one: Contact, by: Acceptance, state: str) -> None:
    assert judged(one, known(accepted=(by,))).state == state


def test_an_arm_without_a_description_is_not_accepted_by_place() -> None:
    bare = Contact(3.0, 3.0, 3.3, ("j2",), "", "", None, "undecided", (), peak_nm={"j2": 12.0})
    assert judged(bare, known(accepted=(entry(),))).state == "new"
    assert judged(bare, known(accepted=(entry(place_m=None),))).state == "accepted"


@pytest.mark.parametrize(
    ("state", "rule", "breaks"),
    [
        ("new", "break", True),
        ("known", "break", True),
        ("back", "break", True),
        ("accepted", "break", False),
        ("new", "allow", True),
        ("known", "allow", False),
        ("back", "allow", True),
        ("accepted", "allow", False),
    ],
)
def test_which_states_break_the_policy(state: str, rule: str, breaks: bool) -> None:
    one = Contact(3.0, 3.0, 3.3, ("j2",), "", "", None, "undecided", (), id="x", state=state, state_text="so")  # type: ignore[arg-type]
    policy = PolicyConfig(known=rule)  # type: ignore[arg-type]
    verdict, _ = decide(policy, Evidence((one,), (), Coverage(10.0, 0.0, {}), Sensitivity({}), (), ()))
    assert (verdict == "fail") == breaks
    assert bool(uncounted_texts([one], policy)) != breaks, "a verdict says what it leaves out"


@pytest.mark.parametrize(
    "changes",
    [
        {"program": None, "place_m": None},
        {"peak_nm": {}},
        {"time_s": (1.0, 2.0)},
    ],
)
def test_an_entry_must_tell_what_it_means(changes: dict[str, object]) -> None:
    with pytest.raises(ValueError, match=r"nothing tells|needs sha256"):
        entry(**changes)
