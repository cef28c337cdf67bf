"""The arm is evaluated in arrays that stay, and each context has its own."""

import numpy as np
from redundant_arms import generated_arm

from geoimp_drake.systems.arm.arm_model import ArmModel


def test_an_arm_evaluated_again_is_that_of_its_own_context() -> None:
    system = ArmModel(generated_arm(7))
    state, arm = system.GetInputPort("state"), system.GetOutputPort("arm")
    motion = system.GetOutputPort("motion_E")
    first = system.CreateDefaultContext()
    state.FixValue(first, np.full(14, 0.1))
    alone, moved = arm.Eval(first).B.copy(), motion.Eval(first)
    copied, another = first.Clone(), system.CreateDefaultContext()
    for context, value in ((copied, 0.2), (another, 0.3)):
        state.FixValue(context, np.full(14, value))
        assert np.abs(arm.Eval(context).B - alone).max() > 1e-3
        np.testing.assert_array_equal(arm.Eval(context).q, np.full(7, value))
    np.testing.assert_array_equal(arm.Eval(first).B, alone)
    np.testing.assert_array_equal(arm.Eval(first).q, np.full(7, 0.1))
    state.FixValue(first, np.full(14, 0.2))
    np.testing.assert_array_equal(arm.Eval(first).B, arm.Eval(copied).B)
    state.FixValue(first, np.full(14, 0.1))
    np.testing.assert_array_equal(motion.Eval(first), moved)
