"""A design gives gains of its frequency and ratio, and a scenario that has them written out."""

import numpy as np
import pytest
import yaml

from geoimp_drake.controllers.gain_design import GainDesign
from geoimp_drake.controllers.impedance_config import TranslationGains
from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import dump_scenario
from geoimp_drake.validation import check

DESIGN = {"natural_frequency": 10.0, "damping_ratio": 0.7, "stiffness": 700.0}
LAYER = {
    "impedance": {
        "translation": {"design": DESIGN},
        "rotation": {
            "design": {
                "natural_frequency": [5.0, 4.0, 2.0],
                "stiffness": 2.0,
                "environment_stiffness": [0.0, 0.0, 30.0],
            }
        },
    }
}
WHERE = "impedance.translation.design"


def scenario(*overrides, layers=(LAYER,)):
    return EXPERIMENTS["plexiglas"].scenario(layers, overrides)


def design(**fields):
    return GainDesign(**{name: np.array(value) for name, value in fields.items()})


def turned(values):
    q, _ = np.linalg.qr(np.arange(9.0).reshape(3, 3) + np.eye(3))
    return (q * np.array(values)) @ q.T


def test_numbers_and_vectors_follow_the_textbook_axis_by_axis():
    M, D, K = design(**DESIGN).gains()
    np.testing.assert_allclose((M, D, K), (7.0, 2.0 * 0.7 * np.sqrt(7.0 * 700.0), 700.0))
    w, zeta, k, k_e = [5.0, 4.0, 2.0], [1.0, 0.5, 2.0], [2.0, 3.0, 4.0], [0.0, 0.0, 30.0]
    fields = {"natural_frequency": w, "damping_ratio": zeta, "stiffness": k}
    M, D, K = design(**fields, environment_stiffness=k_e).gains()
    np.testing.assert_allclose(M, np.divide(k, np.square(w)))
    np.testing.assert_allclose(D, 2.0 * np.multiply(zeta, np.sqrt(M * np.add(k, k_e))))
    np.testing.assert_allclose(K, k)


def test_a_matrix_has_the_frequencies_and_every_mode_the_ratio():
    K, W = turned([300.0, 500.0, 900.0]), np.diag([4.0, 6.0, 9.0])
    M, D, _ = design(natural_frequency=W, damping_ratio=0.6, stiffness=K).gains()
    poles = np.linalg.eigvals(
        np.block([[np.zeros((3, 3)), np.eye(3)], [-np.linalg.solve(M, K), -np.linalg.solve(M, D)]])
    )
    np.testing.assert_allclose(np.sort(np.abs(poles)), [4.0, 4.0, 6.0, 6.0, 9.0, 9.0])
    np.testing.assert_allclose(-poles.real / np.abs(poles), 0.6)
    assert M.shape == D.shape == (3, 3)


def test_a_scenario_has_the_gains_written_out_and_reads_back_the_same():
    made = scenario()
    assert float(made.impedance.translation.mass) == pytest.approx(7.0)
    np.testing.assert_allclose(made.impedance.gains("rotation")[0], np.diag([0.08, 0.125, 0.5]))
    np.testing.assert_allclose(made.impedance.gains("rotation")[1][2, 2], 2.0 * np.sqrt(0.5 * 32.0))
    text = dump_scenario(made)
    again = scenario(layers=(yaml.safe_load(text),))
    assert dump_scenario(again) == text
    for part in ("translation", "rotation"):
        np.testing.assert_array_equal(made.impedance.gains(part), again.impedance.gains(part))


def test_what_is_laid_over_a_design_computes_the_gains_anew():
    written = yaml.safe_load(dump_scenario(scenario()))
    for layers in ((LAYER,), (written,)):
        made = scenario(f"{WHERE}.damping_ratio=1.4", layers=layers).impedance.translation
        np.testing.assert_allclose(made.damping, 2.0 * 98.0)
    whole = scenario(f"{WHERE}={{natural_frequency: 2, stiffness: 8}}", layers=())
    np.testing.assert_allclose(whole.impedance.translation.mass, 2.0)
    assert LAYER["impedance"]["translation"]["design"]["damping_ratio"] == 0.7
    free = scenario(f"{WHERE}=null", "impedance.translation.mass=3").impedance.translation
    assert float(free.mass) == 3.0


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("impedance.translation.stiffness=900", r"stiffness is 900\.0, but \S+design gives 700"),
        (
            "impedance.translation={mass: 2, design: {natural_frequency: 3, stiffness: 9}}",
            "mass is 2",
        ),
        (f"{WHERE}.damping_ratio=-1", r"^\S+design\.damping_ratio is not positive definite"),
        (f"{WHERE}.natural_frequency=[1, 2]", r"natural_frequency has shape \(2,\)"),
        (f"{WHERE}.environment_stiffness=[1, 2]", r"environment_stiffness has shape \(2,\)"),
        (f"{WHERE}.environment_stiffness=-3", "eigenvalue -3"),
        (f"{WHERE}.environment_stiffness=.nan", "environment_stiffness"),
        (f"{WHERE}.frequency=3", "'natural_frequency'"),
        ("impedance.rotation.stiffness_form=seo", "as a 3×3 matrix"),
        ("impedance.translation.principal_axes=[[1,0,0],[0,1,0],[0,0,1]]", "as a 3×3 matrix"),
    ],
)
def test_what_contradicts_a_design_or_is_none_is_refused(override, words):
    with pytest.raises(ConfigurationError, match=words):
        scenario(override)


def test_in_python_the_gains_are_given_beside_their_design():
    made = design(**DESIGN)
    check(TranslationGains(*made.gains(), design=made))
    with pytest.raises(ConfigurationError, match=r"^mass is 9"):
        check(TranslationGains(design=made))


def test_natural_inertia_refuses_a_design():
    given = ("scheme=direct", "inertia=natural", "sensor.inertial_load=plant")
    with pytest.raises(ConfigurationError, match=r"translation\.design gives a mass"):
        scenario(*given)
