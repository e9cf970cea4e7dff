"""Effort is regressed on anything in one place, the torque table; places that are left from before it are counted."""

from __future__ import annotations

import ast
from pathlib import Path

from sources import parsed

TOP = Path(__file__).resolve().parents[2]
#: Routines by which a regression can be made, in this program and in its libraries.
ROUTINES = frozenset(
    {
        "lstsq", "pinv", "solve", "svd", "qr", "eigh", "nnls", "lsq_linear", "least_squares", "curve_fit", "polyfit",
        "basis_of", "generalised_inverse", "robust_fit",
    }
)  # fmt: skip
#: What is solved there is no effort: forces of a sensor, directions of a force, what inertials a motion tells (of the
#: model's torque alone), the straight line nearest to a law, and a plain tool; what asks that of effort is listed.
OTHERS = frozenset(
    {
        "contacts/external_force.py", "friction/identified_description.py", "identification/effort_columns.py",
        "identification/force_sensor.py", "identification/torque_terms.py", "numeric/robust_regression.py",
        "prepare/commanded_force.py", "torque_table/block_sums.py",
    }
)  # fmt: skip
#: The paper's proof, and A, B, C, D with their intervals: laws are fitted to points of friction by speed (pairs of
#: directions, means of sections), each with its error.
OF_POINTS = frozenset({"friction/law_candidates.py", "friction/least_squares.py", "friction/physical_law.py"})
#: Regressions of effort that still stand beside the table. One that goes is taken out here; none comes in.
LEFT = frozenset({"identification/log_cleaning.py"})


def regressing(path: Path) -> bool:
    """Whether a module calls any of the routines, by its name or that of a library's part."""
    calls = [node.func for node in ast.walk(parsed(path)) if isinstance(node, ast.Call)]
    names = {ast.unparse(function) for function in calls if isinstance(function, ast.Attribute | ast.Name)}
    parts = ("linalg", "optimize", "polynomial")
    dotted = {name.rpartition(".")[2] for name in names if any(f"{part}." in name for part in parts)}
    return bool((dotted | (names - {"solve"})) & ROUTINES)


def test_effort_is_regressed_in_the_torque_table_alone() -> None:
    core = TOP / "core"
    found = {path.relative_to(core).as_posix() for path in core.rglob("*.py") if regressing(path)}
    assert found - OTHERS - OF_POINTS - LEFT == set(), "ask the torque table (core/torque_table)"
    assert (OTHERS | OF_POINTS | LEFT) - found == set(), "take what is gone off the list"
