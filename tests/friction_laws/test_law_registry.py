"""One table knows the friction laws: what it promises, that nobody else lists names, and a law that is added to it."""

from __future__ import annotations

import ast
import json
from pathlib import Path

import numpy as np
import pytest
from synthetic import PERIOD, make_log, strokes
from user_guide.pages import config_schema
from user_guide.result_schemas import result_schema

from collaudit.core.audit import audit_log
from collaudit.core.config.describe import all_keys, value_text
from collaudit.core.config.load import parse_config
from collaudit.core.config.schema import Config
from collaudit.core.data.audit_result import Audit, FrictionFile, Provenance
from collaudit.core.data.friction_result import FrictionPoint
from collaudit.core.errors import CollauditError, ConfigError
from collaudit.core.fitting import fit_logs
from collaudit.core.friction.friction_fitting import fit_friction
from collaudit.core.friction.friction_model import FrictionModel
from collaudit.core.friction.law_candidates import FrictionUnits
from collaudit.core.friction_laws.friction_law import FrictionLaw, Parameter, RateTerm, SeparableLaw
from collaudit.core.friction_laws.law_registry import LAWS, LINE, REFERENCE, law_named
from collaudit.core.prepare.preparation import prepare
from collaudit.core.robot.robot_building import build_robot
from collaudit.reports.files.run_files import result_json
from collaudit.reports.files.written_files import read_result
from collaudit.reports.page.html import html_text
from collaudit.reports.values.words import law_text, parameter_meaning

PROJECT = Path(__file__).resolve().parents[2]
UNITS = FrictionUnits.of("revolute", "Nm")
SPEEDS = np.geomspace(0.02, 1.2, 24)
FRICTION_SCHEMA = "collaudit/friction/1"

# What the architecture page asks for: a law in a file of core/friction_laws (here it is in this one) ...


def _lorentz(v: np.ndarray, c: float) -> tuple[np.ndarray, ...]:
    return np.ones_like(v), 1.0 / (1.0 + (c * v) ** 2), v


STRIBECK_LORENTZ = SeparableLaw(
    name="stribeck-lorentz",
    title="Stribeck (Hess and Soom)",
    formula="f(v) = Fc + F1/(1 + (v/vs)²) + sigma2·v",
    parameters=(
        Parameter("Fc", "friction", "Coulomb friction"),
        Parameter("F1", "friction", "breakaway above it"),
        Parameter("vs", "speed", "Stribeck speed"),
        Parameter("sigma2", "viscous", "viscous friction"),
    ),
    breakaway=True,
    shape=_lorentz,
    rate=RateTerm("1/(1 + (v/v_s)²)", "a Lorentz curve", "1/v_s", "gone", ("F1", "vs")),
)
TRUTH = {"Fc": 6.0, "F1": 3.0, "vs": 0.15, "sigma2": 4.0}


@pytest.fixture
def added(monkeypatch: pytest.MonkeyPatch) -> FrictionLaw:
    """... and a line in the table."""
    monkeypatch.setitem(LAWS, STRIBECK_LORENTZ.name, STRIBECK_LORENTZ)
    return STRIBECK_LORENTZ


def true_friction(v: np.ndarray) -> np.ndarray:
    return np.sign(v) * (6.0 + 3.0 / (1.0 + (v / 0.15) ** 2) + 4.0 * np.abs(v))


def points(sd: float) -> list[FrictionPoint]:
    noise = sd * np.random.default_rng(0).standard_normal(SPEEDS.size)
    return [
        FrictionPoint(float(v), float(f), 4 * sd, sd, "pair", 0, False)
        for v, f in zip(SPEEDS, true_friction(SPEEDS) + noise, strict=True)
    ]


def audited(friction: FrictionFile | None, model: str) -> tuple[FrictionFile, Audit]:
    """A level pendulum of 1 kg·m² with the added law's friction: fitted on slow strokes, and judged on them."""
    row = {"a": 0.4, "mass_kg": 6.0, "com_m": [0, 0, 0], "inertia_kg_m2": [0, 0, 0.04, 0, 0, 0]}
    robot_keys = {"dh_convention": "standard", "dh": [row]}  # the axis is upright: no gravity
    config = Config.of({"robot": robot_keys, "friction": {"model": model}, "detect": {"gamma_nm": 2.0}})
    q, v = strokes(np.geomspace(0.03, 1.0, 12))
    effort = true_friction(v) + np.gradient(v, PERIOD)
    effort = effort + np.random.default_rng(1).normal(0.0, 0.1, q.size)
    log = make_log(PERIOD * np.arange(q.size), q[:, None], v[:, None], effort[:, None])
    prepared = prepare(log, build_robot(config.robot, Path(), log.joint_names), config)
    nobody = Provenance("0", {})
    friction = friction or fit_logs([prepared], config, nobody)
    return friction, audit_log(prepared, config, friction, nobody, siblings=None)


def test_an_added_law_is_fitted_and_compared(added: FrictionLaw) -> None:
    asked = fit_friction(points(1e-6), UNITS, added.name)
    assert asked.model == added.name
    assert list(asked.parameters) == ["Fc_nm", "F1_nm", "vs_rad_per_s", "sigma2_nm_s_per_rad"]
    assert list(asked.parameters.values()) == pytest.approx(list(TRUTH.values()), rel=1e-3)
    noisy = fit_friction(points(0.02), UNITS)
    assert noisy.model == added.name
    assert noisy.identifiable
    for (low, high), true in zip(noisy.ci95.values(), TRUTH.values(), strict=True):  # type: ignore[misc]
        assert low < true < high
    model = FrictionModel.of(noisy)
    assert model is not None
    assert model.breakaway_known
    assert model.hold == pytest.approx(9.0, abs=0.2)
    assert model.torque(-SPEEDS) == pytest.approx(true_friction(-SPEEDS), abs=0.05)


def test_what_an_added_law_leaves_open_is_said_in_its_own_terms(added: FrictionLaw) -> None:
    rng = np.random.default_rng(3)
    straight = [
        FrictionPoint(float(v), float(6 + 4 * v + e), 0.2, 0.05, "pair", 0, False)
        for v, e in zip(SPEEDS, 0.05 * rng.standard_normal(SPEEDS.size), strict=True)
    ]
    fit = fit_friction(straight, UNITS, added.name)
    assert not fit.identifiable
    assert any("F1 and vs are not determined" in text for text in fit.not_identifiable)


def test_an_added_law_goes_through_configuration_file_judging_and_report(added: FrictionLaw, tmp_path: Path) -> None:
    friction, judged = audited(None, added.name)
    (tmp_path / "friction.json").write_text(result_json(friction))
    read = read_result(tmp_path / "friction.json", FrictionFile, FRICTION_SCHEMA)
    assert read.joints["joint1"].model == added.name
    _, again = audited(read, "auto")
    assert again.result.residual == judged.result.residual
    rms = judged.result.residual["joint1"].rms_nm
    assert rms is not None
    assert rms < 0.2, "friction of 6 to 10 N·m is left"
    assert judged.result.collisions == ()
    page = html_text([judged])
    assert "Stribeck (Hess and Soom): f(v) = Fc + F1/(1 + (v/vs)²) + sigma2·v" in page
    assert "breakaway above it" in page


def test_an_added_law_is_published(added: FrictionLaw) -> None:
    assert f'"{added.name}"' in config_schema()
    assert added.name in str(result_schema("friction"))
    key = next(key for key in all_keys() if key.dotted == "friction.model")
    assert f'"{added.name}"' in value_text(key)


def test_names_outside_the_table_are_refused(tmp_path: Path) -> None:
    for wrong in ("static-lugr", 3):
        with pytest.raises(ConfigError) as caught:
            parse_config(f"[friction]\nmodel = {wrong!r}\n", None)
        for name in ("auto", *LAWS):
            assert f'"{name}"' in (caught.value.expected or "")
        assert caught.value.hint == ('did you mean "static-lugre"?' if wrong == "static-lugr" else None)
    friction = json.loads(result_json(audited(None, "auto")[0]))
    friction["joints"]["joint1"]["model"] = "auto"  # a choice, and no law
    (tmp_path / "friction.json").write_text(json.dumps(friction))
    with pytest.raises(CollauditError, match="does not have the content") as refused:
        read_result(tmp_path / "friction.json", FrictionFile, FRICTION_SCHEMA)
    assert "there is no friction law 'auto'" in (refused.value.found or "")
    assert "`$.joints[...]`" in (refused.value.found or "")
    assert "static-lugre" in (refused.value.found or "")
    with pytest.raises(CollauditError, match="no friction law"):
        fit_friction(points(0.02), UNITS, "cubic")
    with pytest.raises(CollauditError, match="no friction law"):
        law_named("")


def test_only_the_table_and_its_laws_name_laws() -> None:
    """A name elsewhere would be a case that a new law does not get."""
    found = []
    for room in ("core", "cli", "reports", "fixtures"):
        for path in (PROJECT / room).rglob("*.py"):
            if path.parent.name == "friction_laws":
                continue
            tree = ast.parse(path.read_text(encoding="utf-8"))
            constants = (node for node in ast.walk(tree) if isinstance(node, ast.Constant))
            found += [f"{path.relative_to(PROJECT)}:{node.lineno}" for node in constants if node.value in set(LAWS)]
    assert found == []


@pytest.mark.parametrize("law", LAWS.values(), ids=lambda law: law.name)
def test_every_law_says_all_that_others_need(law: FrictionLaw) -> None:
    assert law_text(law.name) == f"{law.title}: {law.formula}"
    for p in law.parameters:
        symbol = f"{p.symbol}1" if p.numbered else p.symbol
        assert law.parameter(symbol) is p
        key = UNITS.key(law, symbol)
        assert key.partition("_")[0] == symbol
        assert parameter_meaning(law.name, key) == p.meaning
        assert p.symbol in law.formula or law.data_driven
        assert p.meaning or law.data_driven
    if isinstance(law, SeparableLaw) and law.rate is not None:
        assert set(law.rate.unknown) < set(law.symbols)


def test_roles_are_filled_once() -> None:
    assert (LINE.name, REFERENCE.name) == ("coulomb-viscous", "static-lugre")
    assert REFERENCE.as_line is not None
    assert REFERENCE.rate is not None
    assert [law.name for law in LAWS.values() if law.data_driven] == ["rbf"]


def test_symbols_that_keys_could_not_tell_apart_are_refused() -> None:
    for symbols in (("A", "A"), ("A_b", "D"), ("", "D")):
        with pytest.raises(ValueError, match="symbols must differ"):
            SeparableLaw(
                name="toy",
                title="",
                formula="",
                parameters=tuple(Parameter(s, "friction") for s in symbols),
                shape=LINE.shape,
            )


def test_the_guide_has_a_row_for_every_law() -> None:
    page = (PROJECT / "docs" / "method.md").read_text(encoding="utf-8")
    for law in LAWS.values():
        assert f"| `{law.name}` | {law.formula.removeprefix('f(v) = ')}" in page


@pytest.mark.parametrize(
    "law", [law for law in LAWS.values() if isinstance(law, SeparableLaw)], ids=lambda law: law.name
)
def test_a_law_whose_parameters_are_all_zero_is_no_friction(law: SeparableLaw) -> None:
    curve = FrictionModel(law.name, dict.fromkeys(law.symbols, 0.0), (0.01, 1.0), True)
    assert not curve.torque(np.array([-1.0, -0.01, 0.0, 1e-12, 0.5])).any() and curve.hold == 0.0
