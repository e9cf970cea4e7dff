"""The recursions against Pinocchio, sample by sample, on trees of every kind of joint."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import reference_dynamics
from reference_dynamics import Sample

from collaudit.core.robot.pinocchio_model import PinocchioModel
from collaudit.core.robot.rigid_bodies import RigidBodies
from collaudit.core.robot.sample_batches import Batched, Signal, evaluate

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


def compared(program: Batched, reference: Sample, seed: int = 1) -> None:
    """The recursion gives what the reference gives."""
    x = np.random.default_rng(seed).normal(size=(40, program.inputs))
    ours = evaluate(program, [Signal(x)])[0]
    theirs = np.array([reference(row) for row in x]).reshape(ours.shape)  # of one joint Pinocchio drops the axis
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-11 * max(1.0, np.abs(theirs).max()))


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


def test_a_change_of_the_model_afterwards_changes_no_result() -> None:
    model, bodies = tree(6, 3)
    as_it_was = model.copy()
    model.set_armature(model.armature + 1.0)
    model.set_gravity(np.zeros(3))
    compared(bodies.momentum(), reference_dynamics.momentum(as_it_was))


def test_other_parameters_give_other_torques() -> None:
    _, bodies = tree(6, 3)
    x = np.random.default_rng(1).normal(size=(5, 9))
    before = evaluate(bodies.inverse_dynamics(), [Signal(x)])[0]
    heavier = bodies.with_parameters(bodies.inertial_parameters(), bodies.armature + 1.0)
    after = evaluate(heavier.inverse_dynamics(), [Signal(x)])[0]
    np.testing.assert_allclose(after - before, x[:, 6:], atol=1e-12)
