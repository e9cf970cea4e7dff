"""What may have one of several values is asked for each: an ``else`` would take one that is added later for another."""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from sources import parsed

TOP = Path(__file__).resolve().parents[2]


@cache  # when it is asked for, since every process of a test run imports this module
def trees() -> dict[str, ast.Module]:
    """Every module's place and content."""
    return {
        path.relative_to(TOP).as_posix(): parsed(path)
        for package in ("core", "reports", "fixtures", "cli")
        for path in sorted((TOP / package).rglob("*.py"))
    }


def literals() -> dict[str, set[str]]:
    """Names of ``NAME = Literal["…", …]`` with three values or more, and the values."""
    out = {}
    for tree in trees().values():
        for node in tree.body:
            if isinstance(node, ast.Assign) and ast.unparse(node.value).startswith("Literal["):
                values = {x.value for x in ast.walk(node.value) if isinstance(x, ast.Constant)}
                if len(values) > 2:
                    out[ast.unparse(node.targets[0])] = values
    return out


def values_of_names() -> dict[str, set[str]]:
    """Fields and arguments that are annotated with such a literal, and all values that one of their name may have."""
    known, out = literals(), defaultdict(set)
    for tree in trees().values():
        for node in ast.walk(tree):
            if isinstance(node, ast.AnnAssign | ast.arg) and node.annotation is not None:
                name = node.arg if isinstance(node, ast.arg) else ast.unparse(node.target)
                for part in ast.walk(node.annotation):
                    out[name] |= known.get(part.id, set()) if isinstance(part, ast.Name) else set()
    return out


def chains(tree: ast.AST) -> Iterator[tuple[int, str, set[object]]]:
    """Line, subject and values of each ``if x == "a": … elif x == "b": … else: …``."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.If):
            continue
        tests = [node.test]
        rest = node.orelse
        while len(rest) == 1 and isinstance(rest[0], ast.If):
            tests.append(rest[0].test)
            rest = rest[0].orelse
        pairs = [(ast.unparse(t.left), t.comparators[0]) for t in tests
                 if isinstance(t, ast.Compare) and isinstance(t.ops[0], ast.Eq)]  # fmt: skip
        if rest and len(pairs) == len(tests) and len({subject for subject, _ in pairs}) == 1:
            yield node.lineno, pairs[0][0], {x.value for _, x in pairs if isinstance(x, ast.Constant)}


def test_no_else_stands_for_the_values_of_a_literal_that_are_left() -> None:
    known = values_of_names()
    wrong = [
        f"{place}:{line} asks {subject} for {values} only: use match, with assert_never"
        for place, tree in trees().items()
        for line, subject, values in chains(tree)
        if values and values <= known.get(subject.rpartition(".")[2], set())
    ]
    assert not wrong


def test_what_is_left_of_a_match_is_never() -> None:
    """mypy then refuses a value that is added to the literal and not asked for."""
    wrong = []
    for place, tree in trees().items():
        for node in ast.walk(tree):
            if isinstance(node, ast.Match) and "assert_never(" not in ast.unparse(node.cases[-1]):
                wrong.append(f"{place}:{node.lineno}")
    assert not wrong


def test_such_a_chain_is_seen() -> None:
    assert list(chains(ast.parse("if x.kind == 'a':\n    p()\nelse:\n    q()"))) == [(1, "x.kind", {"a"})]


#: Which severities a kind comes with is what its table says; of the quantities of a joint not all are tested; a plain
#: signal is one without a word of any role.
BY_DESIGN = (
    "core/vendors/vendor_words.py",
    "core/findings/finding_kinds.py",
    "core/logs/topics/annotation_topics.py",
)


def partial_tables(tree: ast.Module, known: dict[str, set[str]]) -> Iterator[tuple[int, str]]:
    """Line and name of the literal of each table that has words for two and more of its values, and not for all."""
    for node in (each.value for each in tree.body if isinstance(each, ast.Assign | ast.AnnAssign)):
        if isinstance(node, ast.Dict):
            keys = {key.value if isinstance(key, ast.Constant) else None for key in node.keys}
            about = [name for name, values in known.items() if len(keys) > 1 and keys <= values]
            if about and not any(keys == known[name] for name in about):
                yield node.lineno, " or ".join(about)


def test_a_table_has_every_value_of_a_literal() -> None:
    known = literals()
    wrong = [
        f"{place}:{line} {name}"
        for place, tree in trees().items()
        if place not in BY_DESIGN
        for line, name in partial_tables(tree, known)
    ]
    assert not wrong


def test_a_table_that_lacks_a_value_is_seen() -> None:
    known = {"Kind": {"a", "b", "c"}}
    assert list(partial_tables(ast.parse("x = {'a': 1, 'b': 2}"), known)) == [(1, "Kind")]
    assert not list(partial_tables(ast.parse("x = {'a': 1, 'b': 2, 'c': 3}\ny = {'a': 1, 'z': 2}"), known))
