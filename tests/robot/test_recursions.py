"""The recursions against Pinocchio, sample by sample, on trees of every kind of joint."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np
import pinocchio as pin
import pytest
import reference_dynamics
from reference_dynamics import Sample

from collaudit.core.numeric.arrays import FloatArray
from collaudit.core.robot import newton_euler
from collaudit.core.robot.newton_euler import evaluate
from collaudit.core.robot.pinocchio_model import PinocchioModel

G = np.array([0.3, -1.2, -9.7])


def tree(seed: int, joints: int) -> PinocchioModel:
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
    return PinocchioModel(model)


def compared(recursion: Callable[..., FloatArray], sizes: Sequence[int], reference: Sample, seed: int = 1) -> None:
    """The recursion, whose arguments have so many rows, gives what the reference gives."""
    rows = np.random.default_rng(seed).normal(size=(sum(sizes), 40))
    ours = recursion(*np.split(rows, np.cumsum(sizes)[:-1])).T
    theirs = np.array([reference(row) for row in rows.T]).reshape(ours.shape)  # of one joint Pinocchio drops the axis
    np.testing.assert_allclose(ours, theirs, rtol=1e-10, atol=1e-11 * max(1.0, np.abs(theirs).max()))


@pytest.mark.parametrize("joints", [1, 2, 4, 7])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_any_tree(seed: int, joints: int) -> None:
    pin.seed(seed)
    model, j = tree(seed, joints), joints
    compared(
        partial(newton_euler.inverse_dynamics, model.links, G), (j, j, j), reference_dynamics.inverse_dynamics(model)
    )
    compared(partial(newton_euler.momentum, model.links, G), (j, j), reference_dynamics.momentum(model))
    at_rest = lambda row: reference_dynamics.inverse_dynamics(model)(np.concatenate([row, np.zeros(2 * j)]))  # noqa: E731
    compared(partial(newton_euler.holding, model.links, G), (j,), at_rest)
    for frame in (f"f{joints - 1}", "f0", "base"):
        place = model.frame_placement(frame)
        compared(partial(newton_euler.force, model.links, place), (j, 6), reference_dynamics.force(model, frame, None))
        body = (f"f{joints // 2}", 1.7, np.array([0.1, -0.2, 0.3]))
        carried = (model.frame_placement(body[0]), *body[1:])
        less = partial(newton_euler.force_less_body, model.links, place, carried)
        compared(less, (j, j, j, 6), reference_dynamics.force(model, frame, body))
        mass = (0.8, np.array([0.1, 0.0, -0.2]), G)
        weight = partial(newton_euler.weight, model.links, place, *mass)
        compared(weight, (j,), reference_dynamics.weight(model, frame, *mass))


def test_a_sample_that_is_not_known_leaves_the_others_alone() -> None:
    """Infinite as well as missing, also where the constants of the arm take the input out of the result."""
    model = tree(7, 3)
    q, v, a = np.random.default_rng(1).normal(size=(3, 20, 3))
    torque = partial(newton_euler.inverse_dynamics, model.links, G)
    expected = evaluate(torque, [q, v, a], 3)
    for k, value in enumerate((np.nan, np.inf, -np.inf)):
        (q, v, a)[k][4 * k, 0] = value
    out = evaluate(torque, [q, v, a], 3)
    bad = ~np.isfinite(q + v + a).all(axis=1)
    assert np.isnan(out[bad]).all() and bad.sum() == 3
    np.testing.assert_array_equal(out[~bad], expected[~bad])


def test_other_parameters_give_other_torques() -> None:
    model = tree(6, 3)
    q, v, a = np.random.default_rng(1).normal(size=(3, 3, 5))
    heavier = model.with_parameters(model.inertial_parameters(), model.armature + 1.0)
    before, after = (newton_euler.inverse_dynamics(one.links, G, q, v, a) for one in (model, heavier))
    np.testing.assert_allclose(after - before, a, atol=1e-12)


@pytest.mark.parametrize("bodies", [(), (3,), (0, 2)])
def test_torques_are_linear_in_what_bodies_and_rotors_have_more(bodies: tuple[int, ...]) -> None:
    """Whether none of the bodies differs, one, or some."""
    pin.seed(5)
    rng, model = np.random.default_rng(5), tree(5, 5)
    parameters = model.inertial_parameters().reshape(-1, 10)
    for body in bodies:
        parameters[body] = pin.Inertia.Random().toDynamicParameters()
    other = model.with_parameters(parameters.ravel(), model.armature + rng.uniform(0.0, 1.0, 5))
    motion = rng.normal(size=(3, 5, 20))
    more = [own.less(its) for own, its in zip(other.links, model.links, strict=True)]
    theirs, ours, change = (
        newton_euler.inverse_dynamics(links, G, *motion) for links in (other.links, model.links, more)
    )
    np.testing.assert_allclose(ours + change, theirs, rtol=1e-10, atol=1e-10)
