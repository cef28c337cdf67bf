"""Seo's geometric impedance control has the moments of the quaternion law."""

import numpy as np
import pytest
from law_numerics import random_spd

from geoimp_drake.laws.impedance import quaternion_impedance
from geoimp_drake.laws.impedance.trace_stiffness import stiffness_from_trace_form
from geoimp_drake.rotations import quaternion


def seo_moment(R_DC: np.ndarray, K_R: np.ndarray) -> np.ndarray:
    """Returns the moment on the environment in C that holds the spring, as Seo writes it."""
    S = K_R @ R_DC - R_DC.T @ K_R
    return -np.array([S[2, 1], S[0, 2], S[1, 0]])


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(23)
    return [
        (quaternion.normalized(rng.normal(size=4)), random_spd(rng, 1.0, 10.0)) for _ in range(1000)
    ]


def test_moments_are_those_of_seo(cases):
    for Q_CD, K_R in cases:
        moment = quaternion_impedance.elastic_moment(Q_CD, stiffness_from_trace_form(K_R))
        R_DC = quaternion.to_rotation(Q_CD).T
        np.testing.assert_allclose(moment, seo_moment(R_DC, K_R), rtol=0, atol=1e-12)


def test_potentials_are_those_of_seo(cases):
    for Q_CD, K_R in cases:
        potential = quaternion_impedance.potential_energy(Q_CD, stiffness_from_trace_form(K_R))
        seo = np.trace(K_R @ (np.eye(3) - quaternion.to_rotation(Q_CD).T))
        assert potential == pytest.approx(seo, abs=1e-12)
