"""Where an arm starts: the pose asked for, or an error that says what is in the way."""

import numpy as np
import pytest
from arms import make_arm_plant
from scipy.optimize import minimize

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.arm.state import evaluate_arm
from geoimp_drake.diagrams.setups.posture import StartConfig, start_posture
from geoimp_drake.errors import ConfigurationError, SingularityError
from geoimp_drake.validation import check


def arm_model() -> tuple[ControlModel, np.ndarray, object]:
    """Returns an arm's model, a good posture, and the pose of its hand there."""
    rig = make_arm_plant()
    context = rig.plant.CreateDefaultContext()
    return (
        ControlModel.of_arm(rig.plant, rig.arm, rig.E),
        rig.posture,
        rig.E.CalcPoseInWorld(context),
    )


def xyz_angles_deg(R: np.ndarray) -> np.ndarray:
    """Returns the angles of R = Rx Ry Rz."""
    return np.rad2deg(
        [np.arctan2(-R[1, 2], R[2, 2]), np.arcsin(R[0, 2]), np.arctan2(-R[0, 1], R[0, 0])]
    )


def test_posture_puts_the_hand_where_it_is_asked_for() -> None:
    model, posture, X_WE = arm_model()
    start = StartConfig(
        position=X_WE.translation() + 0.01,
        attitude_deg=xyz_angles_deg(X_WE.rotation().matrix()),
        guess=posture,
    )
    q, X = start_posture(model, start)
    np.testing.assert_allclose(X.translation(), X_WE.translation() + 0.01, atol=1e-5)
    np.testing.assert_allclose(X.rotation().matrix(), X_WE.rotation().matrix(), atol=1e-4)
    assert np.abs(q - posture).max() < 0.3
    again, _ = start_posture(model, StartConfig(posture=q.tolist()))
    np.testing.assert_array_equal(again, q)


def test_tilt_turns_the_hand_about_an_axis_of_W() -> None:
    plain = StartConfig(np.zeros(3))
    tilted = StartConfig(np.zeros(3), tilt_axis=np.array([0.0, 3.0, 0.0]), tilt_deg=30.0)
    turn = tilted.pose().rotation().matrix() @ plain.pose().rotation().matrix().T
    c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
    np.testing.assert_allclose(turn, [[c, 0, s], [0, 1, 0], [-s, 0, c]], atol=1e-12)


def check_refused(start: StartConfig, *texts: str, kind=ConfigurationError) -> None:
    model, _, _ = arm_model()
    with pytest.raises(kind) as error:
        start_posture(model, start)
    for text in texts:
        assert text in str(error.value)


def test_a_posture_outside_the_joint_limits_is_refused_with_joint_and_limits() -> None:
    check_refused(
        StartConfig(posture=[0.4, 0.3, 0.9, 3.2, -0.9, -4.0]),
        "joint4 at 3.2000, allowed -3.0000 to 3.0000",
        "joint6 at -4.0000",
    )


def test_a_pose_out_of_reach_is_refused_with_the_position() -> None:
    start = StartConfig(position=np.array([5.0, 0.0, 0.0]), guess=np.zeros(6))
    check_refused(start, "[5.0, 0.0, 0.0]", "start.guess")
    check_refused(
        StartConfig(position=np.array([5.0, 0.0, 0.0])), "[5.0, 0.0, 0.0]", "within reach"
    )


def test_without_a_guess_a_posture_is_found_by_itself() -> None:
    model, _, X_WE = arm_model()
    attitude = xyz_angles_deg(X_WE.rotation().matrix())
    _, X = start_posture(model, StartConfig(position=X_WE.translation(), attitude_deg=attitude))
    np.testing.assert_allclose(X.translation(), X_WE.translation(), atol=1e-4)
    anywhere, _ = start_posture(model, StartConfig())
    lower, upper = model.plant.GetPositionLowerLimits(), model.plant.GetPositionUpperLimits()
    assert ((anywhere > lower + 0.05) & (anywhere < upper - 0.05)).all()


@pytest.mark.parametrize("posture", [[0.1] * 5, [0.1] * 7, [0.1, 0.2, np.nan, 0.4, 0.5, 0.6]])
def test_a_posture_of_the_wrong_size_or_not_finite_is_refused(posture: list) -> None:
    check_refused(StartConfig(posture=posture), "start.posture", "6 finite numbers")


def singular_posture(model: ControlModel) -> np.ndarray:
    """Returns a posture near the good one in which the Jacobian loses rank, by descent."""
    context = model.plant.CreateDefaultContext()

    def sigma(q: np.ndarray) -> float:
        J = evaluate_arm(model, context, np.concatenate((q, np.zeros(6)))).Jv_V_WE
        return float(np.linalg.svd(J, compute_uv=False)[-1])

    start = np.array([0.4, 0.3, 0.9, 0.5, -0.2, 0.3])
    return minimize(sigma, start, method="Nelder-Mead", options={"fatol": 1e-7}).x


def test_a_singular_posture_is_refused_with_its_singular_value() -> None:
    posture = singular_posture(arm_model()[0])
    assert np.abs(posture).max() < 3.0
    check_refused(StartConfig(posture=posture.tolist()), "singular value", kind=SingularityError)


def test_with_limits_an_arm_starts_in_a_singular_posture() -> None:
    model = arm_model()[0]
    posture = singular_posture(model)
    q, _ = start_posture(model, StartConfig(posture=posture.tolist()), regular=False)
    np.testing.assert_array_equal(q, posture)


@pytest.mark.parametrize(
    ("fields", "texts"),
    [
        ({"position": np.array([0.0, np.nan, 0.0])}, ["start.position", "nan"]),
        ({"position": np.zeros(2)}, ["start.position", "3"]),
        ({"attitude_deg": np.array([np.inf, 0.0, 0.0])}, ["start.attitude_deg", "inf"]),
        ({"tilt_axis": np.zeros(3)}, ["start.tilt_axis is zero"]),
        ({"tilt_deg": np.nan}, ["start.tilt_deg is nan"]),
        ({"tilt_deg": 5.0}, ["start.tilt_deg is 5.0", "start.position is null", "leave tilt_deg"]),
        ({"attitude_deg": np.zeros(3)}, ["start.attitude_deg is [0.0, 0.0, 0.0]", "null"]),
        ({"tilt_axis": np.array([1.0, 0.0, 0.0])}, ["start.tilt_axis is [1.0, 0.0, 0.0]", "null"]),
        ({"guess": np.ones(6)}, ["start.guess is [1.0, ", "null", "Give start.position"]),
    ],
)
def test_a_field_that_cannot_be_used_is_refused_by_name(fields: dict, texts: list[str]) -> None:
    with pytest.raises(ConfigurationError) as error:
        check(StartConfig(**fields), "start")
    for text in texts:
        assert text in str(error.value)
