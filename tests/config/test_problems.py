"""The first problem of a configuration, at its own place; and what a table remembers of what it was given."""

from __future__ import annotations

import copy
import pickle
import re
from pathlib import Path, PurePosixPath
from types import MappingProxyType

import numpy as np
import pytest

from collaudit.core.config import parse_config
from collaudit.core.config.describe import REMOVED, all_keys
from collaudit.core.config.schema import Config, CsvConfig, PhasesConfig, RobotConfig, UnitsConfig
from collaudit.core.errors import ConfigError

#: TOML, and what is said of the first thing that is wrong with it.
CASES = {
    "an item of an array": ('detect.true_events = ["push", 2]', "detect.true_events[1] has a value"),
    "an array of fixed length": ("robot.base_rpy_deg = [0, 1]", "robot.base_rpy_deg has a value"),
    "an item of such an array": ('robot.base_rpy_deg = ["a", 1, 2]', "robot.base_rpy_deg[0] has a value"),
    "a value under a name": ("[detect.gamma_nm]\nbase = 4\nelbow = -1", "detect.gamma_nm has a value"),
    "below a name": (
        "[fleet.robots.b]\npaths = ['x']\ngamma_nm = -1",
        "fleet.robots.gamma_nm has a value",
    ),
    "what a table states": ("[detect]\nn = 3\npersistence_ms = 20", "[detect] give either"),
    "what a table states of a key": ("[phases]\ncontact = [[3, 1]]", "phases.contact: interval"),
    "not finite": ("[robot]\nbase_rpy_deg = [1, nan, 2]", "robot.base_rpy_deg[1] has a value"),
    "a table that may be absent": ('[log.fields]\npositon = "q"', "[log.fields] has no key 'positon'"),
    "not finite where no key is": ("[detct]\ngamma_nm = inf", "the file has no key 'detct'"),
    "not finite where a table belongs": ("robot.dh = {a = nan}", "robot.dh has a value"),
    "not finite where text belongs": ("robot.urdf = [nan]", "robot.urdf has a value"),
    "below one, not finite": ("near_miss.amplitude = nan", "near_miss.amplitude has a value"),
    "too large a number": (f"detect.gamma_nm = 1{400 * '0'}", "detect.gamma_nm has a value"),
    "one kind in a list of columns": ('log.csv.position = ["q1", 2]', "log.csv.position has a value"),
    "either a list or a matrix": ("robot.reduction = [1, [2, 3]]", "robot.reduction has a value"),
    "no such law": ('friction.model = "cubic"', "friction.model has a value"),
    "a date and no text": ("[log]\nwrench = 2026-01-01", "log.wrench has a value"),
    "a table of an array": ("[[robot.dh]]\nd = 1\n[[robot.dh]]\nd = true", "robot.dh[1].d has a value"),
    "an unknown key of such a table": ("[[robot.dh]]\nq = 1", "[robot.dh[0]] has no key 'q'"),
    "a value where a table belongs": ("detect = 5", "detect has a value"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_first_problem_has_its_place(case: str) -> None:
    text, expected = CASES[case]
    with pytest.raises(ConfigError) as caught:
        parse_config(text, None)
    assert expected in caught.value.message


@pytest.mark.parametrize("key", REMOVED)
def test_a_key_of_earlier_versions_says_what_to_do_instead(key: str) -> None:
    """One error with its line; the keys that it names in backticks are keys."""
    *tables, last = key.split(".")
    front = ".".join(tables).replace("fleet.robots", "fleet.robots.cell1")
    with pytest.raises(ConfigError) as caught:
        parse_config(f"[{front}]\n{last} = 1\n", Path("c.toml"))
    assert f"has no key '{last}' any more" in caught.value.message and caught.value.where in ("c.toml:1", "c.toml:2")
    assert caught.value.hint == REMOVED[key]
    known = {one.dotted for one in all_keys()}
    assert key not in known
    for table, named in re.findall(r"\[([\w.]+)\] `(\w+)`", REMOVED[key]):
        assert f"{table}.{named}" in known


def test_names_with_dots_and_signs_are_refused_by_their_table() -> None:
    with pytest.raises(ConfigError, match=r"detect\.gamma_nm"):
        parse_config("", None, {"detect.gamma_nm": {"left.arm` - at `$.x`": -1.0}})


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


def test_what_is_made_in_code_was_given_where_it_differs() -> None:
    assert UnitsConfig(effort="raw", position="rad").given == {"effort"}
    assert RobotConfig(motor_side=["position", "velocity", "effort"]).given == frozenset()
    assert CsvConfig(comment=[]).given == frozenset()


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
    with pytest.raises(ConfigError, match="base_rpy_deg"):
        parse_config("", None, {"robot.base_rpy_deg": (1.0, float("nan"), 0.0)})
    loaded = parse_config("", None, {"robot.joints": list(np.array(["a", "b"])), "detect.n": np.int64(7)})
    assert (loaded.config.robot.joints, loaded.config.detect.n) == (["a", "b"], 7)
    loaded = parse_config("", None, {"robot.urdf": PurePosixPath("x/y"), "detect.gamma_nm": MappingProxyType({1: 2.0})})
    assert (loaded.config.robot.urdf, loaded.config.detect.gamma_nm) == (Path("x/y"), {"1": 2.0})
    with pytest.raises(ConfigError) as caught:
        parse_config("", None, {"robot.urdf": b"x"})
    assert "found:    b'x'" in caught.value.render()
