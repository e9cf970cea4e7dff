"""Every problem of a configuration at once, each at its own place; and what a table remembers of what it was given."""

from __future__ import annotations

import copy
import pickle
import tomllib
from pathlib import Path, PurePosixPath
from types import MappingProxyType

import numpy as np
import pytest

from collaudit.core.config import parse_config
from collaudit.core.config.config_table import plain_values
from collaudit.core.config.problems import problems_of
from collaudit.core.config.schema import Config, CsvConfig, PhasesConfig, RobotConfig, UnitsConfig
from collaudit.core.errors import ConfigError

#: TOML, and where something is wrong with it.
CASES = {
    "nothing": ("detect.n = 5", []),
    "items of an array, each": (
        'detect.true_events = [1, "push", 2, [3]]',
        ["detect.true_events.0", "detect.true_events.2", "detect.true_events.3"],
    ),
    "an array of fixed length, once": ("robot.gravity_m_s2 = [0, 1]", ["robot.gravity_m_s2"]),
    "an item of such an array, with its array": (
        'robot.gravity_m_s2 = ["a", 1, 2]',
        ["robot.gravity_m_s2"],
    ),
    "values under names": (
        "[detect.gamma_nm]\nbase = 4\nelbow = -1\nwrist = 0",
        ["detect.gamma_nm.elbow", "detect.gamma_nm.wrist"],
    ),
    "a name itself": ('[policy.levels]\ncontacts = "warn"\ncontact = "warn"', ["policy.levels.contact"]),
    "below a name": (
        "[detect.evidence.b]\nfastest_rad_s = 1\nhardest_rad_s2 = -1\nload_nm = [0, 1]",
        ["detect.evidence.b.hardest_rad_s2"],
    ),
    "unknown keys of several tables": (
        "[detect]\nfoo = 1\nbar = 2\n[log.csv]\nbaz = 3",
        ["detect.bar", "detect.foo", "log.csv.baz"],
    ),
    "all that is missing": (
        "[detect.evidence.a]\nfastest_rad_s = 1",
        ["detect.evidence.a.hardest_rad_s2", "detect.evidence.a.load_nm"],
    ),
    "what is wrong is not missing": (
        '[detect.evidence.a]\nfastest_rad_s = "1"\nload_nm = [0, 1]\nhardest_rad_s2 = 1',
        ["detect.evidence.a.fastest_rad_s"],
    ),
    "what a table states": ("[detect]\nn = 3\npersistence_ms = 20", ["detect"]),
    "what a table states of a key": ("[phases]\ncontact = [[3, 1]]", ["phases.contact"]),
    "nothing stated of what lost a key": ("[detect]\nn = 3\npersistence_ms = -20", ["detect.persistence_ms"]),
    "not finite": (
        "[detect]\ngamma_nm = inf\ncontroller_alarms_s = [1, nan, 2, nan]",
        ["detect.controller_alarms_s.1", "detect.controller_alarms_s.3", "detect.gamma_nm"],
    ),
    "not finite among others": (
        '[detect]\ncontroller_alarms_s = [1, nan, "x", nan, "y"]\nn = inf\nobserver_gain_per_s = 0.01',
        [
            "detect.controller_alarms_s.1",
            "detect.controller_alarms_s.2",
            "detect.controller_alarms_s.3",
            "detect.controller_alarms_s.4",
            "detect.n",
            "detect.observer_gain_per_s",
        ],
    ),
    "a table that may be absent": (
        '[log.fields]\nnames = "n"\npositon = "q"\neffort = 5\nrobot = 1',
        ["log.fields.positon", "log.fields.robot", "log.fields.effort"],
    ),
    "not finite where no key is": ("[detct]\ngamma_nm = inf", ["detct"]),
    "not finite under a wrong key": ("[robot]\ngrvity = [nan, 0, 0]", ["robot.grvity"]),
    "not finite where a table belongs": ("robot.dh = {a = nan}", ["robot.dh"]),
    "not finite where text belongs": ("robot.urdf = [nan]", ["robot.urdf"]),
    "not finite, and nothing stated": ("[detect]\nn = 3\npersistence_ms = inf", ["detect.persistence_ms"]),
    "below one, not finite": ("near_miss.amplitude = nan", ["near_miss.amplitude"]),
    "too large a number": (f"detect.gamma_nm = 1{400 * '0'}", ["detect.gamma_nm"]),
    "one kind in a list of columns": ('log.csv.position = ["q1", 2]', ["log.csv.position"]),
    "either a list or a matrix": ("robot.reduction = [1, [2, 3]]", ["robot.reduction"]),
    "no such law": ('friction.model = "cubic"', ["friction.model"]),
    "text is no date and a date no text": (
        '[log]\nwrench = 2026-01-01\n[[policy.waivers]]\nrule = "near_misses"\nreason = "why"\nowner = "me"\n'
        'expires = "soon"',
        ["log.wrench", "policy.waivers.0.expires"],
    ),
    "tables of an array": (
        "[[robot.dh]]\nd = 1\n[[robot.dh]]\nd = true\n[[robot.dh]]\nq = 1",
        ["robot.dh.2.q", "robot.dh.1.d"],
    ),
    "a value where a table belongs": ("detect = 5\nlog = [1]", ["detect", "log"]),
}


@pytest.mark.parametrize("case", CASES)
def test_every_problem_has_its_place(case: str) -> None:
    text, expected = CASES[case]
    found = problems_of(tomllib.loads(text))
    assert sorted(".".join(map(str, problem.path)) for problem in found) == sorted(expected)


def test_the_data_stay_as_they_were() -> None:
    data = {"detect": {"true_events": [1, 2], "foo": 1}}
    assert len(problems_of(data)) == 3
    assert data == {"detect": {"true_events": [1, 2], "foo": 1}}


def test_one_of_many_names() -> None:
    """As many trials as names, each of one entry."""
    gamma = {f"joint{k}": 1.0 for k in range(20_000)} | {"last": 0.0}
    assert [p.path for p in problems_of({"detect": {"gamma_nm": gamma}})] == [("detect", "gamma_nm", "last")]


def test_of_very_many_problems_the_first_hundred_are_told() -> None:
    lines = [f"k{k} = 1" for k in range(600)]
    for table, named in (("detect", "[detect] has no key 'k0'"), ("robot.parked", "robot.parked.k0")):
        values = lines if table == "detect" else [f"{line.partition(' ')[0]} = 'x'" for line in lines]
        with pytest.raises(ConfigError) as caught:
            parse_config("\n".join([f"[{table}]", *values]), None)
        text = caught.value.render()
        assert text.startswith("600 problems in the configuration")
        assert len(text) < 100_000
        assert named in text


def test_names_with_dots_and_signs_are_found() -> None:
    data = {"detect": {"gamma_nm": {"left.arm` - at `$.x`": -1.0}}}
    assert [problem.path for problem in problems_of(data)] == [("detect", "gamma_nm", "left.arm` - at `$.x`")]


def test_what_was_given_is_remembered() -> None:
    config = Config.of({"log": {"units": {"effort": "Nm"}}, "robot": {"dh": [{"d": 1}], "dh_convention": "standard"}})
    assert config.given == {"log", "robot"}
    assert config.log.units.given == {"effort"}, "though it is the default"
    assert config.robot.dh[0].given == {"d"}
    assert config.detect.given == frozenset()
    for same in (copy.copy(config), copy.deepcopy(config), pickle.loads(pickle.dumps(config))):
        assert same == config
        assert same.log.units.given == {"effort"}
        assert same.given == config.given
    changed = config.changed({"detect": config.detect.changed({"n": 4})})
    assert changed.given == {"log", "robot", "detect"}
    assert (changed.detect.n, changed.detect.given, changed.log.units.given) == (4, {"n"}, {"effort"})
    assert config.detect.n is None, "the first stays as it was"
    assert config.plain_given() == {
        "log": {"units": {"effort": "Nm"}},
        "robot": {"dh": [{"d": 1.0}], "dh_convention": "standard"},
    }


def test_what_is_made_in_code_was_given_where_it_differs() -> None:
    assert UnitsConfig(effort="raw", position="rad").given == {"effort"}
    assert RobotConfig(motor_side=["position", "velocity", "effort"]).given == frozenset()
    assert CsvConfig(also=[]).given == frozenset()


def test_defaults_are_nobodys_to_change() -> None:
    first = RobotConfig()
    first.dh.append("row")  # type: ignore[arg-type]
    first.motor_side.append("effort")
    assert RobotConfig().dh == []
    assert RobotConfig().motor_side == ["position", "velocity", "effort"]


def test_a_table_cannot_be_changed_in_place() -> None:
    with pytest.raises(AttributeError):
        Config().detect = Config().detect  # type: ignore[misc]


def test_intervals_are_put_in_order() -> None:
    assert PhasesConfig.of({"contact": [[5, 6], [1, 2]]}).contact == [(1.0, 2.0), (5.0, 6.0)]


def test_numbers_of_numpy_are_numbers_from_code() -> None:
    loaded = parse_config("", None, {"detect.gamma_nm": np.float64(3.5), "detect.true_events": ("a", "b")})
    assert type(loaded.config.detect.gamma_nm) is float
    assert loaded.config.detect.true_events == ["a", "b"]
    with pytest.raises(ConfigError, match="2 problems"):
        parse_config("", None, {"detect.controller_alarms_s": (1.0, float("nan"), "x")})
    loaded = parse_config("", None, {"robot.joints": list(np.array(["a", "b"])), "detect.n": np.int64(7)})
    assert (loaded.config.robot.joints, loaded.config.detect.n) == (["a", "b"], 7)
    loaded = parse_config("", None, {"robot.urdf": PurePosixPath("x/y"), "detect.gamma_nm": MappingProxyType({1: 2.0})})
    assert (loaded.config.robot.urdf, loaded.config.detect.gamma_nm) == (Path("x/y"), {"1": 2.0})
    with pytest.raises(ConfigError) as caught:
        parse_config("", None, {"robot.urdf": b"x", "robot.joints": object()})
    assert "found:    b'x'" in caught.value.render()
    with pytest.raises(TypeError, match="no place in a configuration"):
        plain_values({"a": object()})


def test_one_problem_stands_alone_and_several_in_the_order_of_lines() -> None:
    with pytest.raises(ConfigError) as caught:
        parse_config('[log]\nwrench = 1\n[detect]\nn = "4"\nfoo = 2\n', None)
    text = caught.value.render()
    assert text.startswith("3 problems in the configuration")
    assert text.index("log.wrench") < text.index("detect.n") < text.index("'foo'")
