"""Gains and sampling: every value that cannot be used is refused with its name and number."""

import re

import numpy as np
import pytest
from arms import make_arm_plant

from geoimp_drake.controllers.config import (
    ImpedanceControllerConfig,
    MotionConfig,
    RedundancyConfig,
    SamplingConfig,
)
from geoimp_drake.controllers.impedance_config import (
    ImpedanceConfig,
    RotationGains,
    TranslationGains,
)
from geoimp_drake.controllers.impedance_controller import make_impedance_controller
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.validation import (
    check,
    choice,
    finite_vector,
    non_negative,
    positive,
    spd_matrix,
    unknown_name,
)

LOPSIDED = np.array([[3.0, 0.5, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 1.0]])
INDEFINITE = np.array([[1.0, 2.0, 0.0], [2.0, 1.0, 0.0], [0.0, 0.0, 4.0]])

# A gain and what the error must say besides the field's name.
BAD_GAINS = [
    (-700.0, "-700"),
    (0.0, "eigenvalue is 0"),
    (np.nan, "nan"),
    (np.inf, "inf"),
    (np.array([1.0, -2.0, 3.0]), "eigenvalue is -2"),
    (np.array([1.0, np.nan, 3.0]), "nan"),
    (np.array([1.0, 2.0]), "(2,)"),
    (np.ones((2, 3)), "(2, 3)"),
    (np.ones((3, 3, 3)), "(3, 3, 3)"),
    (LOPSIDED, "not symmetric: an entry differs from its mirror image by 0.5"),
    (INDEFINITE, "eigenvalue is -1"),
    (np.diag([1.0, 0.0, 1.0]), "eigenvalue is 0"),
    ([[1.0, 2.0], [3.0]], "lists of equal length"),
    ("stiff", "stiff"),
]
GAINS = [
    f"impedance.{part}.{name}"
    for part in ("translation", "rotation")
    for name in ("mass", "damping", "stiffness")
]


def check_refused(config: ImpedanceControllerConfig, *texts: str) -> None:
    """Checks that a configuration is refused when validated and when a controller is made."""
    rig = make_arm_plant()
    for act in (
        lambda: check(config),
        lambda: make_impedance_controller(rig.plant, rig.arm, rig.E, config),
    ):
        with pytest.raises(ConfigurationError) as error:
            act()
        for text in texts:
            assert text in str(error.value)
        assert "\n" not in str(error.value)


def with_field(path: str, value) -> ImpedanceControllerConfig:
    config = ImpedanceControllerConfig()
    *parents, name = path.split(".")
    target = config
    for parent in parents:
        target = getattr(target, parent)
    assert hasattr(target, name)
    setattr(target, name, value)
    return config


def test_defaults_can_be_used() -> None:
    check(ImpedanceControllerConfig())  # raises otherwise


@pytest.mark.parametrize("path", GAINS)
@pytest.mark.parametrize(("value", "text"), BAD_GAINS, ids=[str(k) for k in range(len(BAD_GAINS))])
def test_a_gain_that_cannot_be_used_is_refused(path: str, value, text: str) -> None:
    check_refused(with_field(path, value), path, text)


@pytest.mark.parametrize("name", ["K_Pp", "K_Dp", "K_Po", "K_Do"])
@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (-65.0, "-65"), (np.nan, "nan"), (np.inf, "inf")]
)
def test_a_gain_of_the_inner_loop_that_cannot_be_used_is_refused(name, value, text) -> None:
    check_refused(with_field(f"motion.{name}", value), f"motion.{name} is {text}")


@pytest.mark.parametrize(
    ("path", "value", "texts"),
    [
        (
            "impedance.orientation",
            "quaternoin",
            ["'quaternoin'", "'quaternion'?", "angle-axis-sin"],
        ),
        ("impedance.axes", "rotations", ["'rotations'", "'rotation'?", "both"]),
        ("motion.orientation", "euler", ["'euler'", "classical-euler", "quaternion"]),
        ("sampling.velocity", "differentiated", ["'differentiated'", "'differenced'?", "measured"]),
    ],
)
def test_an_unknown_name_is_refused_with_the_valid_ones_and_the_nearest(path, value, texts) -> None:
    check_refused(with_field(path, value), *texts)


@pytest.mark.parametrize(("value", "text"), [(0.0, "0 s"), (-1e-3, "-0.001"), (np.nan, "nan")])
def test_a_sampling_period_that_cannot_be_used_is_refused(value, text) -> None:
    check_refused(with_field("sampling.period", value), "sampling.period", text)


@pytest.mark.parametrize(("value", "text"), [(-20.0, "-20"), (np.nan, "nan"), (np.eye(6)[0], "0")])
def test_a_null_space_gain_that_cannot_be_used_is_refused(value, text) -> None:
    check_refused(with_field("redundancy.K_n", value), "redundancy.K_n", text)


def test_a_null_space_gain_of_the_wrong_size_is_refused_with_both_sizes() -> None:
    config = with_field("redundancy.K_n", np.full(5, 20.0))
    rig = make_arm_plant(joints=7)
    with pytest.raises(ConfigurationError, match=r"K_n has shape \(5,\).*7"):
        make_impedance_controller(rig.plant, rig.arm, rig.E, config)


@pytest.mark.parametrize("given", [3.0, np.array(3.0), 3, [3.0, 3.0, 3.0], 3.0 * np.eye(3)])
def test_a_gain_may_be_a_number_a_diagonal_or_a_matrix(given) -> None:
    np.testing.assert_array_equal(spd_matrix(given, "K"), 3.0 * np.eye(3))


def test_a_stiffness_that_is_not_diagonal_is_kept_as_it_is() -> None:
    K = np.array([[3.0, 1.0, 0.2], [1.0, 4.0, 0.0], [0.2, 0.0, 2.0]])
    np.testing.assert_array_equal(spd_matrix(K, "K"), K)


def test_rounding_in_a_symmetric_matrix_is_no_asymmetry() -> None:
    K = 700.0 * np.eye(3)
    K[0, 1], K[1, 0] = 100.0, 100.0 * (1 + 1e-14)
    taken = spd_matrix(K, "K")
    np.testing.assert_array_equal(taken, taken.T)
    K[1, 0] = 100.0 * (1 + 1e-4)
    with pytest.raises(ConfigurationError, match=r"K is not symmetric"):
        spd_matrix(K, "K")


def test_a_stiffness_by_its_principal_axes_in_single_precision_is_symmetric_enough() -> None:
    U = np.array([[0.8, -0.6, 0.0], [0.6, 0.8, 0.0], [0.0, 0.0, 1.0]], dtype=np.float32)
    K = U @ np.diag(np.array([900.0, 100.3, 400.0], dtype=np.float32)) @ U.T
    K[0, 1] += np.float32(1.5e-5)
    K[2, 0] += np.float32(1.5e-5)
    assert np.abs(K - K.T).max() >= 1.5e-5
    taken = spd_matrix(K, "K")
    np.testing.assert_array_equal(taken, taken.T)
    np.testing.assert_allclose(taken, K, atol=2e-5)


def test_numbers_are_checked_with_name_number_and_unit() -> None:
    for act, message in (
        (lambda: positive(-2.0, "period", "s"), "period is -2 s"),
        (lambda: positive(np.inf, "period"), "period is inf"),
        (lambda: non_negative(-0.5, "bias"), "bias is -0.5"),
        (lambda: non_negative(np.nan, "bias"), "bias is nan"),
        (lambda: finite_vector([1, 2], "point", 3), "point is [1.0, 2.0]; give 3 finite numbers"),
        (lambda: finite_vector([1, 2, np.nan], "point", 3), "nan"),
        (lambda: finite_vector("here", "point", 3), "point is 'here'"),
        (lambda: choice("tree", "kind", ("three", "four")), "Did you mean 'three'?"),
    ):
        with pytest.raises(ConfigurationError, match=re.escape(message)):
            act()
    non_negative(0.0, "bias")
    positive(1e-9, "period")
    choice("four", "kind", ("three", "four"))


def test_no_name_is_suggested_when_none_is_near() -> None:
    error = unknown_name("zzz", "kind", ("three", "four"))
    assert "Did you mean" not in str(error)
    assert "four, three" in str(error)


@pytest.mark.parametrize(
    ("path", "value", "texts"),
    [
        ("motion.K_Pp", [1.0, 2.0], ["[1.0, 2.0]", "a number"]),
        ("motion.K_Pp", "stiff", ["'stiff'", "a number"]),
        ("sampling.period", "1ms", ["'1ms'", "a number"]),
        ("sampling.velocity", 3, ["is 3", "a text"]),
        ("impedance.translation.mass", "heavy", ["'heavy'", "numbers"]),
        ("impedance.translation", 9.0, ["TranslationGains", "9.0"]),
        ("redundancy.k_beta", None, ["None", "a number"]),
        ("redundancy.damping.threshold", True, ["True", "a number"]),
        ("redundancy.task", {"kind": "none"}, ["TaskConfig", "{'kind': 'none'}"]),
        ("form", "fused", ["'fused'", "blocks, compiled"]),
        ("scheme", "direkt", ["'direkt'", "inner-loop"]),
    ],
)
def test_a_value_of_another_type_is_refused_by_the_name_of_its_field(path, value, texts) -> None:
    check_refused(with_field(path, value), path, *texts)


@pytest.mark.parametrize(
    ("path", "key", "texts"),
    [
        ("", "impedence", ["ImpedanceControllerConfig 'impedence'", "'impedance'?"]),
        ("impedance.translation", "stifness", ["impedance.translation", "'stiffness'?"]),
    ],
)
def test_an_attribute_that_is_no_field_is_refused_with_the_nearest_name(path, key, texts) -> None:
    config = ImpedanceControllerConfig()
    part = config
    for name in filter(None, path.split(".")):
        part = getattr(part, name)
    setattr(part, key, 3.0)
    check_refused(config, f"'{key}'", *texts)


def test_a_configuration_by_itself_names_its_fields_without_a_path() -> None:
    with pytest.raises(ConfigurationError, match=r"^mass is not positive definite"):
        check(TranslationGains(mass=np.array(-1.0)))
    with pytest.raises(ConfigurationError, match=r"^gains\.mass is not positive definite"):
        check(TranslationGains(mass=np.array(-1.0)), "gains")


def test_principal_axes_that_cannot_be_used_are_named() -> None:
    config = with_field("impedance.rotation.principal_axes", 2.0 * np.eye(3))
    check_refused(config, "impedance.rotation.principal_axes", "orthonormal")


def test_two_configurations_share_nothing() -> None:
    one, other = ImpedanceControllerConfig(), ImpedanceControllerConfig()
    one.impedance.translation.stiffness[...] = 1.0
    one.redundancy.K_n[...] = 1.0
    assert float(other.impedance.translation.stiffness) == 700.0
    assert float(other.redundancy.K_n) == 0.0
    for kind in (TranslationGains, RotationGains, ImpedanceConfig, MotionConfig, SamplingConfig):
        assert kind() is not kind()
    assert float(RedundancyConfig().K_n) == 0.0


def test_seos_stiffness_becomes_the_quaternion_laws() -> None:
    rotation = RotationGains(stiffness=np.array([20.0, 30.0, 10.0]), stiffness_form="seo")
    _, _, K_o = ImpedanceConfig(rotation=rotation).gains("rotation")
    np.testing.assert_allclose(K_o, np.diag([40.0, 30.0, 50.0]))
