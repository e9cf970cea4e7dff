"""Dynamics against Lagrange's equations that SymPy derives: no recursion, no rigid-body library."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import sympy as sp

from collaudit.core.robot.pinocchio_model import PinocchioModel

G = np.array([0.5, -1.0, -9.5])
#: About the x axis by asin(3/5), about y by acos(5/13): exact in fractions.
ABOUT_X = sp.Matrix([[1, 0, 0], [0, sp.Rational(4, 5), -sp.Rational(3, 5)], [0, sp.Rational(3, 5), sp.Rational(4, 5)]])
ABOUT_Y = sp.Matrix(
    [[sp.Rational(5, 13), 0, sp.Rational(12, 13)], [0, 1, 0], [-sp.Rational(12, 13), 0, sp.Rational(5, 13)]]
)
ROTATIONS = (ABOUT_X, ABOUT_Y, ABOUT_X)
OFFSETS = (sp.Matrix([0.1, 0, 0.3]), sp.Matrix([0.2, -0.1, 0]), sp.Matrix([0, 0.25, 0]))
MASSES = (3.0, 2.0, 1.2)
CENTRES = (sp.Matrix([0.02, 0.1, 0]), sp.Matrix([0, 0.03, 0.12]), sp.Matrix([0.05, -0.02, 0.08]))
#: About the centres of mass, kg·m².
INERTIAS = (
    sp.diag(0.05, 0.04, 0.03),
    sp.diag(0.02, 0.03, 0.04),
    sp.Matrix([[0.05, 0.004, -0.002], [0.004, 0.04, 0.003], [-0.002, 0.003, 0.03]]),
)
ROTORS = (0.3, 0.0, 0.1)
KINDS = ("revolute", "prismatic", "revolute")

Q, V, A = (sp.symbols(f"{letter}:3") for letter in "qva")


def arm() -> PinocchioModel:
    """The same arm for Pinocchio."""
    model = pin.Model()
    model.gravity.linear = G
    for k in range(3):
        joint = pin.JointModelPZ() if KINDS[k] == "prismatic" else pin.JointModelRZ()
        place = pin.SE3(np.array(ROTATIONS[k], dtype=float), np.array(OFFSETS[k], dtype=float).ravel())
        number = model.addJoint(k, joint, place, f"j{k}")
        body = pin.Inertia(MASSES[k], np.array(CENTRES[k], dtype=float).ravel(), np.array(INERTIAS[k], dtype=float))
        model.appendBodyToJoint(number, body, pin.SE3.Identity())
    model.armature = np.array(ROTORS)
    return PinocchioModel(model)


def energies() -> tuple[Any, Any]:
    """Kinetic and potential energy from the poses of the links: velocities are derivatives of places and rotations."""
    rotation, place = sp.eye(3), sp.zeros(3, 1)
    kinetic, potential = sp.Integer(0), sp.Integer(0)

    def rate(x: sp.Matrix) -> sp.Matrix:
        return sum((x.diff(q) * v for q, v in zip(Q, V, strict=True)), sp.zeros(*x.shape))

    for k, q in enumerate(Q):
        place = place + rotation * OFFSETS[k]
        rotation = rotation * ROTATIONS[k]
        if KINDS[k] == "prismatic":
            place = place + rotation * sp.Matrix([0, 0, q])
        else:
            rotation = rotation * sp.Matrix([[sp.cos(q), -sp.sin(q), 0], [sp.sin(q), sp.cos(q), 0], [0, 0, 1]])
        centre = place + rotation * CENTRES[k]
        velocity = rate(centre)
        skew = rotation.T * rate(rotation)
        spin = sp.Matrix([skew[2, 1], skew[0, 2], skew[1, 0]])
        kinetic += MASSES[k] * velocity.dot(velocity) / 2 + spin.dot(INERTIAS[k] * spin) / 2 + ROTORS[k] * V[k] ** 2 / 2
        potential -= MASSES[k] * sp.Matrix(G).dot(centre)
    return kinetic, potential


@pytest.fixture(scope="module")
def lagrange() -> Any:
    """From q, v, a: torques, momenta ∂T/∂v, and ∂T/∂q - ∂V/∂q, each (3,)."""
    kinetic, potential = energies()
    momentum = sp.Matrix([kinetic.diff(v) for v in V])
    rest = sp.Matrix([(kinetic - potential).diff(q) for q in Q])
    torque = momentum.jacobian(V) * sp.Matrix(A) + momentum.jacobian(Q) * sp.Matrix(V) - rest
    return sp.lambdify([*Q, *V, *A], [list(torque), list(momentum), list(rest)], modules="numpy", cse=True)


def test_torques_and_momenta_obey_lagranges_equations(lagrange: Any) -> None:
    x = np.random.default_rng(4).uniform(-2.0, 2.0, (50, 9))
    torque, *momenta = (np.column_stack(part) for part in lagrange(*x.T))
    q, v, a = np.split(x.T, 3)
    np.testing.assert_allclose(arm().inverse_dynamics(q, v, a).T, torque, atol=1e-11)
    np.testing.assert_allclose(arm().momentum(q, v).T, np.column_stack(momenta), atol=1e-9)
