"""Plain words: phrases that readers stumbled over stay away, and equation numbers stay in one page."""

from __future__ import annotations

import ast
import re
from functools import cache
from pathlib import Path

from sources import parsed
from user_guide.pages import pages

from collaudit.core.findings.finding_kinds import KINDS

PROJECT = Path(__file__).resolve().parents[2]
READ = sorted({PROJECT / "README.md", PROJECT / "CHANGELOG.md", *(PROJECT / "docs").rglob("*.md")})
SHOWN = sorted([*(PROJECT / "reports").rglob("*.j2"), *(PROJECT / "reports" / "terminal").glob("*.py")])
#: Each was a riddle to a reader, and has a plain equivalent in docs/glossary.md or in the sentence that replaced it.
RIDDLES = (
    r"motion that was judged",
    r"in which a contact could be seen",
    r"joint-seconds",
    r"only the rest was read",
    r"blind in \d",
    r"what moves in friction",
    r"identified besides friction",
    r"by the tail\b",
    r"by the hours alone",
    r"certainty about",
    r"friction only an interval",
    r"proves nothing",
    r"rests? on the (robot )?model",
    r"the findings? should go\b",
    r"the hours it rests on",
    r"what the data cannot tell",
    r"words to stderr",
    r"a machine may read",
    r"than this break the policy",
    r"what the robot does to the environment",
    r"slower stretches are",
    r"the loss is stated in",
    r"stands? beside it",
    r"are of one moment",
    r"bodies that cannot be",
    r"alike likely",
    r"bears the name",
    r"\bnobody (stated|told|wrote|asked|knows)",
    r"\bis told so\b",
    r"too-fast, edge, too-brief",
    r"\b(was|were|as) planted\b",
    r"made so far",
    r"told nothing but",
    r"tells? (them|it) not apart",
    r"\bever less\b",
    r"as one that the drive",
    r"moved ahead by",
    r"harder than all",
    r"takes? the # away",
    r"mends it and is true",
    r"does not go with the rest",
    r"never heard of again",
    r"the motion does not tell",
    r"how far behind the positions",
    r"on time left out",
)
ANY_RIDDLE = "|".join(f"(?:{pattern})" for pattern in RIDDLES)


@cache
def plain(path: Path) -> str:
    """A text on one line, so that phrases are found across line ends."""
    return " ".join(path.read_text(encoding="utf-8").split())


def found(pattern: str, text: str) -> list[str]:
    return [text[max(0, m.start() - 40) : m.end() + 40] for m in re.finditer(pattern, text, re.IGNORECASE)]


def test_no_riddles_in_pages_and_reports() -> None:
    assert {path.name: said for path in (*READ, *SHOWN) if (said := found(ANY_RIDDLE, plain(path)))} == {}


@cache
def messages() -> dict[str, str]:
    """What the program may print: every text in its code but docstrings, by file."""
    texts = {}
    for path in sorted(p for room in ("cli", "core", "reports") for p in (PROJECT / room).rglob("*.py")):
        tree = parsed(path)
        alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        said = (n.value for n in ast.walk(tree) if isinstance(n, ast.Constant) and id(n) not in alone)
        texts[str(path)] = " ".join(" ".join(text for text in said if isinstance(text, str)).split())
    return texts


def test_no_riddles_in_messages() -> None:
    assert {name: said for name, text in messages().items() if (said := found(ANY_RIDDLE, text))} == {}


def test_no_riddles_in_findings_and_help() -> None:
    texts = {code: " ".join([kind.meaning, kind.remedy]) for code, kind in KINDS.items()}
    texts |= {name: text for name, text in pages().items() if not name.endswith(".json")}
    for name, text in texts.items():
        line = " ".join(text.split())
        assert found(ANY_RIDDLE, line) == [], name


def test_the_paper_and_its_equations_are_in_their_own_page_only() -> None:
    for path in READ:
        if path.name not in ("paper.md", "CHANGELOG.md"):
            text = re.sub(r"\[The paper\]\([^)]*paper\.md\)", "", plain(path))
            assert found(r"\bthe paper\b", text) == [], path.name
            assert found(r"\beqs?\. ?\(?\d|\brule \(\d+\)|\bequation \(?\d", text) == [], path.name


def test_the_test_would_notice() -> None:
    assert any("would have alarmed" in text for text in messages().values())
    assert not any("phrases that readers stumbled over" in text for text in messages().values())
    assert found(RIDDLES[3], "The log is damaged. Only the rest was read.")
    assert found(r"\beqs?\. ?\(?\d", "must lie within contact (eq. 1)")


def test_the_readme_stays_short() -> None:
    """Two screens with the picture; benchmarks have pages of their own."""
    lines = (PROJECT / "README.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) <= 110
    assert sum(line.startswith("![") or "<img " in line for line in lines) == 1
    assert not any(word in line.lower() for line in lines for word in ("benchmark", "times faster", "processor time"))
