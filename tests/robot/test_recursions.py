"""Recorded recursions against Pinocchio, sample by sample, on trees of every kind of joint."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from collaudit.core.robot import newton_euler, reference_dynamics
from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.recorded_program import Program, Recorder
from collaudit.core.robot.rigid_bodies import RigidBodies
from collaudit.core.robot.sample_batches import Batched, OneByOne, Signal, evaluate

G = np.array([0.3, -1.2, -9.7])


def tree(seed: int, joints: int) -> tuple[PinocchioModel, RigidBodies]:
    """Joints about and along any axis, some on the same parent, bodies and rotors on each, a frame on the last."""
    rng = np.random.default_rng(seed)
    model = pin.Model()
    model.gravity.linear = G
    for k in range(joints):
        axis = rng.normal(size=3)
        kinds = (
            pin.JointModelRevoluteUnaligned(axis / np.linalg.norm(axis)),
            pin.JointModelPrismaticUnaligned(axis / np.linalg.norm(axis)),
            pin.JointModelRX(), pin.JointModelRY(), pin.JointModelRZ(), pin.JointModelPY(),
        )  # fmt: skip
        above = list(model.supports[k])  # Pinocchio wants joints depth first
        parent = above[-1] if rng.random() < 0.7 else above[rng.integers(len(above))]
        number = model.addJoint(parent, kinds[rng.integers(len(kinds))], pin.SE3.Random(), f"j{k}")
        model.appendBodyToJoint(number, pin.Inertia.Random(), pin.SE3.Identity())
        model.addFrame(pin.Frame(f"f{k}", number, 0, pin.SE3.Random(), pin.FrameType.OP_FRAME))
    model.addFrame(pin.Frame("base", 0, 0, pin.SE3.Random(), pin.FrameType.FIXED_JOINT))
    model.armature = rng.uniform(0.0, 1.0, joints)
    built = PinocchioModel(model)
    return built, RigidBodies(built)


def compared(program: Batched, slow: OneByOne, seed: int = 1) -> None:
    """The program was recorded, not replaced, and gives what the reference gives."""
    assert isinstance(program, Program)
    x = np.random.default_rng(seed).normal(size=(40, slow.inputs))
    fast, theirs = (evaluate(p, [Signal(x)])[0] for p in (program, slow))
    np.testing.assert_allclose(fast, theirs, rtol=1e-10, atol=1e-11 * max(1.0, np.abs(theirs).max()))


@pytest.mark.parametrize("joints", [1, 2, 4, 7])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_any_tree(seed: int, joints: int) -> None:
    pin.seed(seed)
    model, bodies = tree(seed, joints)
    compared(bodies.inverse_dynamics(), reference_dynamics.inverse_dynamics(model))
    compared(bodies.momentum(), reference_dynamics.momentum(model))
    for frame in (f"f{joints - 1}", "f0", "base"):
        compared(bodies.force(frame), reference_dynamics.force(model, frame, None))
        body = (f"f{joints // 2}", 1.7, np.array([0.1, -0.2, 0.3]))
        compared(bodies.force(frame, body), reference_dynamics.force(model, frame, body))
        mass = (frame, 0.8, np.array([0.1, 0.0, -0.2]), G)
        compared(bodies.weight(*mass), reference_dynamics.weight(model, *mass))
        compared(bodies.torques(frame), reference_dynamics.torques(model, frame, None))
        body = (frame, 1.7, np.array([0.1, -0.2, 0.3]))
        compared(bodies.torques(frame, body), reference_dynamics.torques(model, frame, body))


def test_a_recursion_that_is_wrong_is_not_used(monkeypatch: pytest.MonkeyPatch) -> None:
    model, bodies = tree(5, 3)
    right = newton_euler.inverse_dynamics_program
    monkeypatch.setattr(newton_euler, "inverse_dynamics_program", lambda links, g: right(links, 1.001 * np.asarray(g)))
    program = bodies.inverse_dynamics()
    assert isinstance(program, OneByOne)
    x = np.random.default_rng(1).normal(size=(5, 9))
    work = model.workspace()
    expected = [work.inverse_dynamics(*np.split(row, 3)).copy() for row in x]
    np.testing.assert_array_equal(evaluate(program, [Signal(x)])[0], expected)


def test_a_sample_that_is_not_known_leaves_the_others_alone() -> None:
    """Infinite as well as missing, also where the constants of the arm take the input out of the result."""
    _, bodies = tree(7, 3)
    x = np.random.default_rng(1).normal(size=(20, 9))
    expected = evaluate(bodies.inverse_dynamics(), [Signal(x)])[0]
    for k, value in enumerate((np.nan, np.inf, -np.inf)):
        x[4 * k, 3 * k] = value
    out = evaluate(bodies.inverse_dynamics(), [Signal(x)])[0]
    bad = ~np.isfinite(x).all(axis=1)
    assert np.isnan(out[bad]).all()
    np.testing.assert_array_equal(out[~bad], expected[~bad])


def test_the_reference_works_in_threads() -> None:
    """Each thread has memory of its own: a frame's pose is not overwritten by the other's."""
    model, bodies = tree(8, 5)
    q = np.random.default_rng(1).normal(size=(30_000, 5))
    mass = ("f4", 1.0, np.array([0.1, 0.2, 0.3]), G)
    fast, slow = (evaluate(p, [Signal(q)])[0] for p in (bodies.weight(*mass), reference_dynamics.weight(model, *mass)))
    np.testing.assert_allclose(slow, fast, atol=1e-9)


def test_a_change_of_the_model_afterwards_changes_no_program() -> None:
    model, bodies = tree(6, 3)
    as_it_was = model.copy()
    model.set_armature(model.armature + 1.0)
    model.set_gravity(np.zeros(3))
    compared(bodies.momentum(), reference_dynamics.momentum(as_it_was))


def test_other_parameters_are_recorded_anew() -> None:
    _, bodies = tree(6, 3)
    x = np.random.default_rng(1).normal(size=(5, 9))
    before = evaluate(bodies.inverse_dynamics(), [Signal(x)])[0]
    heavier = bodies.with_parameters(bodies.inertial_parameters(), bodies.armature + 1.0)
    after = evaluate(heavier.inverse_dynamics(), [Signal(x)])[0]
    np.testing.assert_allclose(after - before, x[:, 6:], atol=1e-12)


numbers = st.floats(-3.0, 3.0).map(lambda x: round(x, 2))
picks = st.integers(0, 99)
operations = st.lists(st.tuples(st.sampled_from("+-*sck"), picks, picks, numbers), max_size=30)


def carry_out(kind: str, p: Any, q: Any, number: float, sine: Any, cosine: Any) -> Any:
    """One operation on recorded or on computed values."""
    return {"+": operator.add, "-": operator.sub, "*": operator.mul, "k": lambda p, _: number * p + 1.5,
            "s": lambda p, _: sine(p), "c": lambda p, _: cosine(p)}[kind](p, q)  # fmt: skip


@settings(max_examples=200, deadline=None)
@given(operations=operations, wanted=st.lists(picks, min_size=1, max_size=5))
def test_a_program_replays_what_was_computed(operations: list[tuple[str, int, int, float]], wanted: list[int]) -> None:
    """The same arithmetic on values and on arrays, with constants 0 and 1 among them and results used often."""
    x = np.random.default_rng(2).normal(size=(3, 11))
    recorder = Recorder(3)
    recorded: list[Any] = [*recorder.inputs(), 0.0, 1.0, -1.0]
    computed: list[Any] = [*x, 0.0, 1.0, -1.0]
    for kind, a, b, number in operations:
        for values, functions in ((recorded, (recorder.sine, recorder.cosine)), (computed, (np.sin, np.cos))):
            values.append(carry_out(kind, values[a % len(values)], values[b % len(values)], number, *functions))
    picked = [k % len(recorded) for k in wanted]
    run = recorder.program([recorded[k] for k in picked]).run_of(11)
    run.inputs[:] = x
    run.run()
    for row, k in zip(run.outputs, picked, strict=True):
        expected = np.broadcast_to(computed[k], 11)
        np.testing.assert_allclose(row, expected, rtol=1e-9, atol=1e-9 * max(1.0, np.abs(expected).max()))
