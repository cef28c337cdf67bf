"""A run's log as a labelled data set: named dimensions, named components, units."""

import zipfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.extras import needs_extra
from geoimp_drake.parts.impedance_energy import ImpedanceEnergy
from geoimp_drake.parts.joint_limits import Limited
from geoimp_drake.systems.frame_motion import FrameMotion
from geoimp_drake.typing import Array

if TYPE_CHECKING:
    from xarray import Dataset

__all__ = ["joint_columns", "load_log", "read_log"]

# Of the joints' log: velocities are differenced over both neighbours of a row.
_FEWEST_ROWS = 20

# The components of one dimension: their names, each with its unit.
_Components = dict[str, str]

_MOTION_UNITS = {
    "quaternion": "1",
    "position": "m",
    "angular_velocity": "rad/s",
    "linear_velocity": "m/s",
    "angular_acceleration": "rad/s^2",
    "linear_acceleration": "m/s^2",
}
_MOTION = {name: _MOTION_UNITS[name[:-2]] for name in FrameMotion.get_fields()}
_WRENCH = {f"moment_{c}": "N m" for c in "xyz"} | {f"force_{c}": "N" for c in "xyz"}
_LIMITED = dict(zip(Limited.get_fields(), ["1"] * 4 + ["rad/s^2"] * 3 + ["m/s^2"] * 3, strict=True))
_ENERGY = {name: "W" if name.endswith("power") else "J" for name in ImpedanceEnergy.get_fields()}
_PLANE = {"normal_x": "1", "normal_y": "1", "normal_z": "1", "offset": "m"}
_POINT = dict.fromkeys("xyz", "m")

# A joint's coordinate is an angle, but that of a track is a length.
_JOINT = {
    "q": ("rad", "m"),
    "set_point": ("rad", "m"),
    "v": ("rad/s", "m/s"),
    "u": ("N m", "N"),
    "compensation": ("N m", "N"),
    "prismatic": ("1", "1"),
}
_ON_TRACK = "seven"


def load_log(path: str | Path) -> "Dataset":
    """Opens the log of a run as a labelled data set.

    For instance `load_log("out")["six_wrench"].sel(wrench="force_z").plot()`.

    Each key of the log, with `_` instead of `/`, is a variable over `time` [s] and one dimension of
    named components. The dimensions are `motion` (quaternion_w … linear_acceleration_z), `wrench`
    (moment_x … force_z), `energy`, `six_joint`, `seven_joint`, `plane` and `point`. The attribute
    `units` holds the variable's units. Where components have different units, it lists each unit
    once. The coordinate `motion_units` (`wrench_units`, …, `seven_q_units`) then lists them
    component by component. A joint's units follow from the log's `seven/prismatic`; without that
    they are not given. `to_netcdf` writes the whole data set.

    Args:
        path: the folder of a run, or its log.npz.

    Returns:
        The data set; its attributes `scenario` (YAML) and `metrics` (JSON) are the texts of the
        files beside the log.

    Raises:
        ConfigurationError: there is no such log, it cannot be read, or the extra `data` is missing.
    """
    with needs_extra("data", "A labelled log"):
        import xarray
    file = Path(path) / "log.npz" if Path(path).is_dir() else Path(path)
    log = read_log(file)
    t = log.pop("t")
    coordinates: dict[str, Any] = {"time": ("time", t, {"units": "s"})}
    variables = {}
    for key, values in log.items():
        # Time is the first axis of whatever changes with time; constants are vectors.
        dimensions = ("time",) if values.ndim > 1 else ()
        name, components = _components(log, key)
        units = list(components.values())
        attributes = {"units": ", ".join(dict.fromkeys(units))} if any(units) else {}
        variables[_plain(key)] = ((*dimensions, name), values, attributes)
        coordinates[name] = list(components)
        if len(set(units)) > 1:
            # Joints have different units in q and in v.
            owner = _plain(key) if name.endswith("_joint") else name
            coordinates[f"{owner}_units"] = (name, units)
    return xarray.Dataset(variables, coordinates, attrs=_beside(file))


def _plain(key: str) -> str:
    """Returns a name that netCDF also accepts."""
    return key.replace("/", "_")


def read_log(file: Path) -> dict[str, Array]:
    """Returns the arrays of a run's log.npz; raises ConfigurationError if it cannot be read."""
    try:
        with file.open("rb") as stream:
            log = np.load(stream)
            arrays = {key: log[key] for key in getattr(log, "files", ())}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
        raise ConfigurationError(f"The log {file} cannot be read: {error}") from error
    if "t" not in arrays:
        raise ConfigurationError(
            f"{file} has no times 't' and is no log of a run; it has: "
            f"{', '.join(arrays) or 'nothing'}."
        )
    return arrays


def _components(log: dict[str, Array], key: str) -> tuple[str, _Components]:
    """Returns the dimension of a variable's components, their names and units."""
    owner, _, what = key.rpartition("/")
    size = log[key].shape[-1]
    known = {
        "motion": ("motion", _MOTION),
        "wrench": ("wrench", _WRENCH),
        "plane": ("plane", _PLANE),
        "limited": ("limit", _LIMITED),
        "energy": ("energy", _ENERGY),
        "disk": ("point", _POINT),
    }
    if what in _JOINT:
        slides = log.get(f"{owner}/prismatic", np.full(size, np.nan))
        return f"{_plain(owner)}_joint", _joints(owner, _JOINT[what], slides)
    dimension, components = known.get(what.partition("_")[0], ("", {}))
    if len(components) == size:
        return dimension, components
    return f"{_plain(key)}_component", {str(k): "" for k in range(size)}


def _joints(arm: str, units: tuple[str, str], slides: Array) -> _Components:
    """Returns names and units of joints; whether each of them slides may be unknown (NaN)."""
    names = [f"joint_{k + 1}" for k in range(len(slides))]
    if arm == _ON_TRACK and slides[0]:
        names = ["track", *names[:-1]]
    turning, sliding = units
    unit_of = {0.0: turning, 1.0: sliding}
    return dict(zip(names, (unit_of.get(float(slide), "") for slide in slides), strict=True))


def _beside(file: Path) -> dict[str, str]:
    """Returns the texts of the scenario and the metrics of the same run."""
    files = [file.with_name(name) for name in ("scenario.yaml", "metrics.json")]
    return {path.stem: _read_beside(path) for path in files if path.is_file()}


def _read_beside(path: Path) -> str:
    try:
        return path.read_text(encoding="utf-8")
    except (OSError, ValueError) as error:
        raise ConfigurationError(f"{path} cannot be read: {error}") from error


def joint_columns(log: dict[str, Array], arm: str, model: ControlModel) -> tuple[Array, ...]:
    """Returns t, and q, v, torques (each base first) and wrench, of the rows without gaps.

    Args:
        log: arrays of a run or a drive, by key.
        arm: the arm's name in the log.
        model: the arm.

    Raises:
        ConfigurationError: the log is not of this arm, or too short.
    """
    names, n = ("q", "v", "u", "wrench"), model.num_joints
    missing = [f"{arm}/{name}" for name in names if f"{arm}/{name}" not in log]
    if missing:
        raise ConfigurationError(
            f"The log has no {', '.join(missing)}; it has {', '.join(log)}. Give log.npz of a run "
            f"or a drive of the arm '{arm}'."
        )
    q, v, u, wrench = (log[f"{arm}/{name}"] for name in names)
    if q.shape[1] != n:
        raise ConfigurationError(f"The log's arm has {q.shape[1]} joints, '{arm}' has {n}.")
    known = np.isfinite(np.hstack((log["t"][:, None], q, v, u, wrench))).all(axis=1)
    if known.sum() < _FEWEST_ROWS:
        raise ConfigurationError(
            f"The log has {known.sum()} rows without gaps; a motion needs {_FEWEST_ROWS} or more."
        )
    order = model.state_order
    q, v = q[:, order[:n]], v[:, order[n:] - n]
    columns = (log["t"], q, v, u[:, np.argsort(model.actuation_order)], wrench)
    return tuple(column[known] for column in columns)
