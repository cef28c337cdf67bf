"""A run's log opens in one line with named components and units."""

import json

import numpy as np
import pytest
import xarray

import geoimp_drake
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.systems.frame_motion import ANGULAR_VELOCITY, QUATERNION, FrameMotion

N = 5
# The log contract: every key with its size.
ARMS = {"six": 6, "seven": 7}
MOTIONS = [f"{arm}/motion_{F}" for arm in ARMS for F in "EDCr"]
MOTIONS += [f"object/motion_{F}" for F in "ODC"] + ["hole/motion_H"]
WRENCHES = [f"{arm}/{key}" for arm in ARMS for key in ("wrench", "wrench_true")]
WRENCHES += ["object/wrench", "object/wrench_internal"]


def contract_log() -> dict[str, np.ndarray]:
    """Returns a log with every key of the contract; all numbers differ."""
    sizes = dict.fromkeys(MOTIONS, 19) | dict.fromkeys(WRENCHES, 6)
    sizes |= {f"{arm}/{key}": n for arm, n in ARMS.items() for key in "qvu"}
    sizes |= {"six/set_point": 6, "six/energy": 9}
    random = np.random.default_rng(1)
    log = {key: random.normal(size=(N, size)) for key, size in sizes.items()}
    constants = {f"{arm}/prismatic": np.zeros(n) for arm, n in ARMS.items()}
    constants["seven/prismatic"][0] = 1.0
    constants |= {"surface/plane": np.array([0.0, 0.0, 1.0, 0.2]), "surface/disk": np.zeros(3)}
    return {"t": 0.01 * np.arange(N), **log, **constants}


@pytest.fixture
def run(tmp_path):
    np.savez(tmp_path / "log.npz", **contract_log())
    return tmp_path


def test_nothing_is_changed_or_left_out(run):
    data, log = geoimp_drake.load_log(run), contract_log()
    assert set(data.data_vars) == {key.replace("/", "_") for key in log} - {"t"}
    for key in log.keys() - {"t"}:
        np.testing.assert_array_equal(data[key.replace("/", "_")], log[key])
    np.testing.assert_array_equal(data["time"], log["t"])
    assert data["time"].attrs == {"units": "s"}


def test_motions_and_wrenches_have_named_components_with_units(run):
    data, log = geoimp_drake.load_log(run / "log.npz"), contract_log()
    for key in MOTIONS:
        variable = data[key.replace("/", "_")]
        assert variable.dims == ("time", "motion")
        view = FrameMotion(log[key][2])
        assert variable.sel(motion="position_z")[2] == view.position_z
        assert variable.attrs["units"] == "1, m, rad/s, m/s, rad/s^2, m/s^2"
    for key in WRENCHES:
        variable = data[key.replace("/", "_")]
        assert variable.dims == ("time", "wrench")
        assert variable.sel(wrench="moment_y")[3] == log[key][3, 1]
        assert variable.sel(wrench="force_x")[3] == log[key][3, 3]
    assert list(data["wrench_units"]) == ["N m"] * 3 + ["N"] * 3
    assert list(data["motion_units"][QUATERNION]) == ["1"] * 4
    assert list(data["motion_units"][ANGULAR_VELOCITY]) == ["rad/s"] * 3


def test_joints_are_named_and_the_track_is_a_length(run):
    data = geoimp_drake.load_log(run)
    assert data["six_q"].dims == data["six_set_point"].dims == ("time", "six_joint")
    assert [data[f"six_{key}"].attrs["units"] for key in "qvu"] == ["rad", "rad/s", "N m"]
    assert list(data["six_joint"].values) == [f"joint_{k}" for k in range(1, 7)]
    assert list(data["seven_joint"].values) == ["track", *(f"joint_{k}" for k in range(1, 7))]
    assert list(data["seven_q_units"].values) == ["m"] + ["rad"] * 6
    assert list(data["seven_u_units"].values) == ["N"] + ["N m"] * 6


def test_constants_have_no_time(run):
    data = geoimp_drake.load_log(run)
    assert data["surface_plane"].dims == ("plane",)
    assert float(data["surface_plane"].sel(plane="offset")) == 0.2
    assert data["surface_disk"].dims == ("point",)
    assert data["surface_disk"].attrs["units"] == "m"


def test_a_constant_with_as_many_numbers_as_samples_is_still_a_constant(tmp_path):
    np.savez(tmp_path / "log.npz", t=np.arange(4.0), **{"surface/plane": np.arange(4.0)})
    data = geoimp_drake.load_log(tmp_path)
    assert data["surface_plane"].dims == ("plane",)


def test_unknown_keys_are_kept_without_units(tmp_path):
    np.savez(tmp_path / "log.npz", t=np.arange(3.0), **{"six/other": np.ones((3, 2))})
    data = geoimp_drake.load_log(tmp_path)
    assert data["six_other"].shape == (3, 2)
    assert data["six_other"].attrs == {}


def test_scenario_and_metrics_beside_the_log_come_along(run):
    assert geoimp_drake.load_log(run).attrs == {}
    (run / "scenario.yaml").write_text("experiment: plexiglas\nduration: 2.5\n")
    (run / "metrics.json").write_text(json.dumps({"claims": [{"name": "x", "holds": True}]}))
    attributes = geoimp_drake.load_log(run).attrs
    assert attributes["scenario"] == "experiment: plexiglas\nduration: 2.5\n"
    assert json.loads(attributes["metrics"])["claims"][0]["holds"] is True


@pytest.mark.parametrize("content", [None, b"", b"text", b"PK\x03\x04 cut short"])
def test_what_is_no_log_is_refused(tmp_path, content):
    if content is not None:
        (tmp_path / "log.npz").write_bytes(content)
    with pytest.raises(ConfigurationError, match=r"log\.npz cannot be read"):
        geoimp_drake.load_log(tmp_path)


def test_other_arrays_are_refused(tmp_path):
    np.savez(tmp_path / "log.npz", a=np.zeros(3))
    with pytest.raises(ConfigurationError, match=r"no times 't'.*it has: a"):
        geoimp_drake.load_log(tmp_path)
    np.save(tmp_path / "log.npy", np.zeros(3))
    with pytest.raises(ConfigurationError, match="it has: nothing"):
        geoimp_drake.load_log(tmp_path / "log.npy")


def test_unreadable_metrics_are_named(run):
    (run / "metrics.json").write_bytes(b"\xff")
    with pytest.raises(ConfigurationError, match=r"metrics\.json cannot be read"):
        geoimp_drake.load_log(run)


def test_units_of_joints_are_not_guessed(tmp_path):
    log = {"t": np.arange(3.0), "any/q": np.ones((3, 2)), "any/u": np.ones((3, 2))}
    np.savez(tmp_path / "log.npz", **log)
    assert geoimp_drake.load_log(tmp_path)["any_q"].attrs == {}
    np.savez(tmp_path / "log.npz", **log, **{"any/prismatic": np.array([0.0, 1.0])})
    data = geoimp_drake.load_log(tmp_path)
    assert list(data["any_q_units"].values) == ["rad", "m"]
    assert list(data["any_u_units"].values) == ["N m", "N"]
    assert list(data["any_joint"].values) == ["joint_1", "joint_2"]


def test_a_data_set_is_kept_as_netcdf(run, tmp_path):
    (run / "scenario.yaml").write_text("experiment: plexiglas # µ\n", "utf-8")
    (run / "metrics.json").write_text("{}")
    data = geoimp_drake.load_log(run)
    data.to_netcdf(tmp_path / "log.nc")
    with xarray.open_dataset(tmp_path / "log.nc", decode_times=False) as again:
        xarray.testing.assert_identical(again.load(), data)
