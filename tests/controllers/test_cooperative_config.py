"""The configuration of two arms: read over its defaults, and refused by name."""

import numpy as np
import pytest
from internal_gains import bar_internal
from pydrake.common.yaml import yaml_load_typed
from pydrake.multibody.plant import MultibodyPlant
from two_arms import ArmPair, add_arms

from geoimp_drake.controllers.cooperative_config import CooperativeControllerConfig
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.parts.internal_impedance import is_open
from geoimp_drake.systems.cooperation.cooperative_kinematics import ObjectLoad
from geoimp_drake.validation import check


@pytest.fixture(scope="module")
def parallel() -> ArmPair:
    return add_arms(MultibodyPlant(1e-3))


@pytest.mark.parametrize(
    ("part", "key", "value", "text"),
    [
        ("internal", "axes", "x", "internal.axes"),
        ("monitor", "dwell", -1.0, r"monitor\.dwell"),
        ("opened", "after", "drop", r"opened\.after"),
        ("load", "mass", np.inf, r"load\.mass"),
        ("monitor", "fall_time", 1e-4, r"monitor\.fall_time .* no fall is that fast"),
        ("sampling", "period", 0.06, "internal.translation.damping"),
    ],
)
def test_field_that_cannot_be_used_is_named(
    parallel: ArmPair, part: str, key: str, value, text: str
) -> None:
    config = CooperativeControllerConfig(load=ObjectLoad(), internal=bar_internal())
    setattr(getattr(config, part), key, value)
    for act in (check, parallel.controller):
        with pytest.raises(ConfigurationError, match=text):
            act(config)


@pytest.mark.parametrize("scheme", ["direct", "admittance"])
def test_a_scheme_without_inner_loops_is_refused_with_the_reason(
    parallel: ArmPair, scheme: str
) -> None:
    config = CooperativeControllerConfig(scheme=scheme)
    for act in (check, parallel.controller):
        with pytest.raises(ConfigurationError, match=rf"scheme is '{scheme}'; two arms .* inner"):
            act(config)


def test_an_attribute_that_is_no_field_is_refused(parallel: ArmPair) -> None:
    config = CooperativeControllerConfig()
    config.monitors = None
    with pytest.raises(
        ConfigurationError, match=r"CooperativeControllerConfig 'monitors'.*'monitor'"
    ):
        parallel.controller(config)


def test_configuration_is_read_from_yaml_over_its_defaults() -> None:
    text = """
    internal: {translation: {damping: 300.0}, enabled: false}
    mutual_pose: {position: [0.0, 0.9, 0.0]}
    load: {mass: 4.5, inertia: [[0.3, 0, 0], [0, 0.1, 0], [0, 0, 0.3]]}
    opened: {after: retreat}
    """
    config = yaml_load_typed(
        schema=CooperativeControllerConfig, data=text, defaults=CooperativeControllerConfig()
    )
    check(config)
    assert config.internal.translation.damping == 300.0
    assert is_open(config.internal.translation.mass)
    assert config.mutual_pose is not None
    np.testing.assert_array_equal(config.mutual_pose.quaternion, [1.0, 0.0, 0.0, 0.0])
    assert (config.load.mass, config.opened.after) == (4.5, "retreat")
