"""The norm of the quaternion that is integrated: over many steps it does not drift."""

import numpy as np
import pytest
from impedance_rig import (
    D_P,
    K_P,
    M_P,
    fixed_step,
    impedance_diagram,
    swinging_wrench,
    turning_motion,
)
from pydrake.math import RigidTransform
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import Context

from geoimp_drake.compilation.compiled import compilable
from geoimp_drake.laws.impedance.families import QuaternionImpedance
from geoimp_drake.systems.impedance_integrator import ImpedanceIntegrator

STEP = 1e-3
MOMENT = [0.8, 0.5, 1.0, 0.0, 0.0, 0.0]
RATES = [0.9, 1.7, 0.4, 0.0, 0.0, 0.0]
DRAG, INERTIA = 4.0, 0.4  # [Nms/rad], [kg m²]


@compilable
def drag(Q_WD, w_WD, dw_WD, Q_WC, w_WC, mu_W, M_inv, D_o, K_o):
    return (DRAG * (w_WD - w_WC) - mu_W) / INERTIA


class Drag(QuaternionImpedance):
    """A mass in a fluid that turns with D: cheap to evaluate, and C never comes to rest."""

    law = staticmethod(drag)


def turning_impedance(rotation) -> tuple[Simulator, Context]:
    """Returns a simulator of D turning at 2 rad/s under a changing moment, and C's context."""
    impedance = ImpedanceIntegrator(M_P, D_P, K_P, rotation, "rotation")
    wrench = swinging_wrench(MOMENT, RATES)
    diagram = impedance_diagram(impedance, turning_motion(2.0), wrench, RigidTransform())
    simulator = fixed_step(diagram, STEP)
    simulator.AdvanceTo(STEP)
    return simulator, impedance.GetMyMutableContextFromRoot(simulator.get_mutable_context())


def quaternions(rotation, steps: int, every: int) -> np.ndarray:
    """Returns the quaternion of the state as the integrator has left it, one a row."""
    simulator, context = turning_impedance(rotation)
    rows = []
    for k in range(every, steps + 1, every):
        simulator.AdvanceTo(k * STEP)
        rows.append(context.get_continuous_state_vector().CopyToVector()[:4])
    return np.array(rows)


def norm_error(Q: np.ndarray) -> float:
    return float(np.abs(np.linalg.norm(Q, axis=1) - 1.0).max())


def test_norm_of_the_state_does_not_drift() -> None:
    Q = quaternions(Drag(np.eye(3), np.eye(3), np.eye(3)), 100_000, 10)
    first, *later = (norm_error(part) for part in np.split(Q, 10))
    print(f"\ngreatest norm error in each tenth of 1e5 steps: {first:.2e}, {later}")
    assert np.ptp(Q, axis=0).min() > 0.2  # it has turned, and about every axis
    assert first < 1e-10
    assert max(later) <= first  # what steps add up would be most at the end


def test_norm_stays_one_from_the_first_step_on_with_the_chapters_law() -> None:
    law = QuaternionImpedance(0.4 * np.eye(3), 5.0 * np.eye(3), 2.0 * np.eye(3))
    assert norm_error(quaternions(law, 2000, 1)) < 1e-9


@pytest.mark.parametrize("factor", [0.99, 1.01])
def test_a_norm_that_is_off_is_seen_and_put_right_by_the_next_step(factor: float) -> None:
    simulator, context = turning_impedance(Drag(np.eye(3), np.eye(3), np.eye(3)))
    state = context.get_mutable_continuous_state_vector()
    x = state.CopyToVector()
    state.SetFromVector(np.append(factor * x[:4], x[4:]))
    assert norm_error(state.CopyToVector()[None, :4]) == pytest.approx(0.01)
    simulator.AdvanceTo(3 * STEP)
    assert norm_error(state.CopyToVector()[None, :4]) < 1e-9
