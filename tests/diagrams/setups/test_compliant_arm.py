"""An arm of the cell on its own joint servos, with the scheme admittance."""

import numpy as np
from runs import assert_all_hold, claims_of, run

from geoimp_drake.controllers.config import FORMS

PERIODS = ("servos.period=0.004", "sampling.period=0.004")


def test_the_plexiglas_is_pressed_by_streamed_references_as_by_torques():
    assert_all_hold(claims_of("plexiglas", "scheme=admittance", *PERIODS))


def test_both_forms_with_their_sensor_leave_the_same_log():
    still = "scheme=admittance", "duration=0.3", *PERIODS
    blocks, compiled = (run("plexiglas", *still, f"form={form}")[0] for form in FORMS)
    assert set(blocks) == set(compiled)
    for name in blocks:
        np.testing.assert_allclose(compiled[name], blocks[name], atol=1e-9, err_msg=name)
