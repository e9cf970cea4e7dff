"""TOML that collaudit writes: what it says comes back, what is commented out does not, nothing hides."""

from __future__ import annotations

import tomllib

from hypothesis import given
from hypothesis import strategies as st

from collaudit.cli.drafts.config_text import Section, document
from collaudit.core.small_files import to_toml, toml_key

TEXT = st.text(st.characters(exclude_categories=["Cs"]), max_size=12)
VALUES = st.recursive(
    st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | TEXT,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(TEXT, inner, max_size=3),
    max_leaves=8,
)


@given(VALUES)
def test_a_value_comes_back_as_it_was(value: object) -> None:
    text = to_toml(value)
    assert tomllib.loads(f"v = {text}") == {"v": value}
    assert text.isprintable()


@given(TEXT)
def test_a_key_comes_back_as_it_was(name: str) -> None:
    assert tomllib.loads(f"{toml_key(name)} = 1") == {name: 1}


def test_layout_of_a_value() -> None:
    assert to_toml({"joint1": 0.1, "b c": [1, [2.0]]}) == '{ joint1 = 0.1, "b c" = [1, [2.0]] }'
    assert to_toml("a\u202eb\U000e0001") == '"a\\u202eb\\U000e0001"'


def test_layout_of_a_configuration() -> None:
    sections = {name: Section(name) for name in ("robot", "robot.tool", "log.csv", "log.units", "policy")}
    sections["robot"].add("urdf", "arm.urdf", "as given")
    sections["robot.tool"].add("com_m", [0.0, 0.05], active=False)
    sections["log.csv"].remarks.append("Columns of the file.")
    sections["log.csv"].add("time", "t", "recognised by name", guess=True)
    sections["log.units"].add("effort_sign", {"A 1": -1}, "hostile\n[policy]", active=False)
    sections["policy"].add("max_collisions", 0, "hostile\nmax_collisions = 9")
    assert document(["Head."], sections) == (
        "# Head.\n"
        "\n"
        "[robot]\n"
        'urdf = "arm.urdf"  # as given\n'
        "\n"
        "# [robot.tool]\n"
        "# com_m = [0.0, 0.05]\n"
        "\n"
        "[log.csv]\n"
        "# Columns of the file.\n"
        'time = "t"  # GUESS: recognised by name\n'
        "\n"
        "# [log.units]\n"
        '# effort_sign = { "A 1" = -1 }  # hostile\\x0a[policy]\n'
        "\n"
        "[policy]\n"
        "max_collisions = 0  # hostile\\x0amax_collisions = 9\n"
    )
