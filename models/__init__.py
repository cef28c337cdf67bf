"""Robots, sensor, tools and surfaces, installed as `geoimp_drake.models`.

PROVENANCE.md beside this file names the source of each number. `python -m
geoimp_drake.models.generate` writes the model files from the tables in `robot_data`.
"""

from pathlib import Path

from pydrake.multibody.parsing import PackageMap

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.models.robot_data import dh_to_joint, joint_to_dh

__all__ = ["PACKAGE", "dh_to_joint", "joint_to_dh", "model_path", "package_map"]

PACKAGE = "geoimp_models"

_FOLDER = Path(__file__).resolve().parent


def model_path(name: str) -> str:
    """Returns the path of the model file `name`, such as `"six_joint_arm"` or a full file name.

    Raises:
        ConfigurationError: there is no such model; the message lists the valid names.
    """
    models = {path.stem: path for path in sorted(_FOLDER.glob("*.urdf"))}
    stem = name.removesuffix(".urdf")
    if stem not in models:
        raise ConfigurationError(f"no model is called {name!r}; choose from {', '.join(models)}")
    return str(models[stem])


def package_map() -> PackageMap:
    """Returns the package map in which `package://geoimp_models/…` finds these models."""
    packages = PackageMap()
    packages.AddPackageXml(str(_FOLDER / "package.xml"))
    return packages
