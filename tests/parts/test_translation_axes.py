"""Gains of translation in D's axes: the spring turns with D, wherever K_p is read."""

import numpy as np
import pytest

from geoimp_drake.controllers.config import MotionConfig
from geoimp_drake.controllers.impedance_config import ImpedanceConfig, TranslationGains
from geoimp_drake.controllers.sensor_checks import linear_gains
from geoimp_drake.diagrams.experiments.measures import force_spring_error
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.frame_motion import (
    ACCELERATION,
    LINEAR_ACCELERATION,
    LINEAR_VELOCITY,
    POSITION,
    QUATERNION,
)
from geoimp_drake.parts.impedance_energy import Energies, ImpedanceEnergy
from geoimp_drake.rotations import quaternion

K = np.diag([900.0, 400.0, 100.0])
M, D = np.diag([2.0, 5.0, 9.0]), np.diag([300.0, 200.0, 100.0])
COUPLING = np.array([[0.0, 4.0, 0.0], [0.0, 0.0, 3.0], [5.0, 0.0, 0.0]])
Q_WD = quaternion.exp(np.array([0.7, -1.1, 0.4]))
R_WD = quaternion.to_rotation(Q_WD)
DP = np.array([0.02, -0.01, 0.03])


def config(axes: str = "desired", coupling=None) -> ImpedanceConfig:
    return ImpedanceConfig(TranslationGains(M, D, K, axes=axes), coupling=coupling)


def motions() -> tuple[np.ndarray, np.ndarray]:
    """Returns D, and C that is displaced alone."""
    desired = np.zeros(19)
    desired[QUATERNION] = Q_WD
    compliant = desired.copy()
    compliant[POSITION] -= DP
    return desired, compliant


def test_the_law_is_that_of_world_axes_seen_from_d():
    desired, compliant = motions()
    compliant[LINEAR_VELOCITY] = [0.1, 0.2, -0.3]
    wrench = np.array([0.0, 0.0, 0.0, 5.0, -7.0, 3.0])
    turned = config().make().motion_of(desired, wrench, compliant[:13])[LINEAR_ACCELERATION]
    force, dv = R_WD.T @ wrench[3:], R_WD.T @ -compliant[LINEAR_VELOCITY]
    expected = -np.linalg.solve(M, force - D @ dv - K @ R_WD.T @ DP)
    np.testing.assert_allclose(R_WD.T @ turned, expected, rtol=1e-12)


@pytest.mark.parametrize(("axes", "coupling"), [("desired", None), ("world", COUPLING)])
def test_c_rests_where_the_spring_in_d_holds_the_force(axes, coupling):
    desired, compliant = motions()
    wrench = np.zeros(6)
    wrench[3:] = R_WD @ K @ R_WD.T @ DP
    if coupling is not None:
        wrench[:3] = R_WD @ coupling @ R_WD.T @ DP
    motion = config(axes, coupling).make().motion_of(desired, wrench, compliant[:13])
    np.testing.assert_allclose(motion[ACCELERATION], 0.0, atol=1e-10)
    log = {"t": np.zeros(1), "arm/motion_D": desired[None], "arm/motion_C": compliant[None]}
    log["arm/wrench"] = wrench[None]
    everything = np.array([True])
    assert force_spring_error(log, "arm", config(axes, coupling), everything) < 1e-12
    _, _, stiffness, _, _ = linear_gains(config(axes, coupling), MotionConfig(), R_WD)
    np.testing.assert_allclose(stiffness[3:, 3:] @ DP, wrench[3:], rtol=1e-12)


@pytest.mark.parametrize(("axes", "coupling"), [("desired", None), ("world", COUPLING)])
def test_the_potential_is_that_of_the_spring_in_d(axes, coupling):
    desired, compliant = motions()
    compliant[LINEAR_VELOCITY] = [0.1, 0.2, -0.3]
    impedance, in_desired = config(axes, coupling).make(), axes == "desired"
    energies = Energies(M, impedance.rotation)
    gains = impedance.gains(None)
    energy = ImpedanceEnergy(energies.evaluate(desired, compliant, np.ones(6), gains))
    in_D, dv = R_WD.T @ DP, -compliant[LINEAR_VELOCITY]
    dv_of_gains = R_WD.T @ dv if in_desired else dv
    assert energy.translational_potential == pytest.approx(0.5 * in_D @ K @ in_D)
    assert energy.translational_kinetic == pytest.approx(0.5 * dv_of_gains @ M @ dv_of_gains)
    assert energy.translational_dissipated_power == pytest.approx(dv_of_gains @ D @ dv_of_gains)
    assert energy.translational_supplied_power == pytest.approx(dv.sum())


def test_other_axes_are_refused_with_the_valid_ones():
    with pytest.raises(ConfigurationError, match=r"impedance\.translation\.axes.*desired, world"):
        config("compliant").make()
