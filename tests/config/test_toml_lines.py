"""The line finder against TOML texts written by hand and made by Hypothesis."""

import tomllib

from hypothesis import given
from hypothesis import strategies as st

from collaudit.core.small_files import key_lines

TEXT = '''# comment with [brackets] and = signs
top = "a # no comment"
"quoted key" = 1   # trailing

[robot]
urdf = 'C:\\no\\escape'
base = [
  1, # one
  2,
]
tool.mass = 3
[[robot.dh]]
a = 1
[[robot.dh]]
"al\\u0070ha" = { x = 1, y = [2, 3] }
[robot.dh.sub]
k = 1979-05-27 07:32:00
[text]
long = """
[not.a.table]
x = 1 """"
after = \'\'\'it's\'\'\'
'''


def test_lines_of_tables_and_keys() -> None:
    tomllib.loads(TEXT)
    lines = key_lines(TEXT)
    assert lines[("top",)] == 2
    assert lines[("quoted key",)] == 3
    assert lines[("robot",)] == 5
    assert lines[("robot", "urdf")] == 6
    assert lines[("robot", "base")] == 7
    assert lines[("robot", "tool", "mass")] == 11
    assert (lines[("robot", "dh", 0)], lines[("robot", "dh", 1)]) == (12, 14)
    assert lines[("robot", "dh", 0, "a")] == 13
    assert lines[("robot", "dh", 1, "alpha", "y")] == 15
    assert lines[("robot", "dh", 1, "sub", "k")] == 17
    assert lines[("text", "long")] == 19
    assert lines[("text", "after")] == 22
    assert ("not", "a", "table") not in lines


def test_windows_line_ends() -> None:
    assert key_lines("a = 1\r\n[t]\r\nb = 2\r\n")[("t", "b")] == 3


def _paths(value: object, front: tuple = ()) -> set:
    """Of tables and keys; what is in an array stands at its key."""
    children = value.items() if isinstance(value, dict) else ()
    found = {front} if front else set()
    for key, inner in children:
        found |= _paths(inner, (*front, key))
    return found


_keys = st.text(alphabet='ab.#="[ ]{}é-_1', min_size=1, max_size=6)
_scalars = st.one_of(
    st.integers(-9, 9), st.booleans(), st.floats(allow_nan=False), st.text(alphabet="a#\"'[]{},=\\\n.", max_size=8)
)
_values = st.recursive(_scalars, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(_keys, inner, max_size=3))


def _basic(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n") + '"'


def _dump(value: object, newline: str) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return _basic(value)
    if isinstance(value, list):
        return "[" + "".join(f"{newline}{_dump(inner, newline)}," for inner in value) + newline + "]"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_basic(key)} = {_dump(inner, newline)}" for key, inner in value.items()) + "}"
    return repr(value)


@given(
    st.dictionaries(_keys, st.dictionaries(_keys, _values, max_size=3), max_size=4),
    st.sampled_from(["", "\n", " # ]\n"]),
)
def test_every_path_of_any_document_has_its_line(document: dict, newline: str) -> None:
    rows: list[str] = []
    expected: dict[tuple, int] = {}
    for table, content in document.items():
        rows.append(f"[{_basic(table)}]")
        expected[(table,)] = len(rows)
        for key, value in content.items():
            expected[(table, key)] = len(rows) + 1
            rows.extend(f"{_basic(key)} = {_dump(value, newline)}".split("\n"))
    text = "\n".join(rows)
    lines = key_lines(text)
    assert set(lines) == _paths(tomllib.loads(text))
    assert expected.items() <= lines.items()
