"""Friction of the joints from the log of a motion."""

import json

import numpy as np
import pytest
from library_tree import ROOT

from geoimp_drake import cli

STUDY = ROOT / "docs" / "validation" / "studies" / "friction.yaml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A run with 2 % Coulomb friction, 60 % more viscous friction, and noise in the sensor."""
    out = tmp_path_factory.mktemp("friction")
    more = ("--set", "world.joints.viscous=1.6", "--no-figures", "--out", str(out))
    assert cli.main(("run", "--scenario", str(STUDY), *more)) == 0
    return out


def test_friction_is_found_within_ten_percent(folder, capsys):
    out = folder / "found.json"
    assert cli.main(("identify", "--friction", str(folder), "--json", str(out))) == 0
    found = json.loads(out.read_text(encoding="utf-8"))
    with np.load(folder / "log.npz") as log:
        true = log["world/coulomb"]
    coulomb = [joint["coulomb"] for joint in found]
    np.testing.assert_allclose(coulomb, true, rtol=0.1)
    more = 0.6 * np.array([34.4, 190.5, 21.0, 4.66, 4.66, 4.66])
    seen = [joint["viscous"] is not None for joint in found]
    assert sum(seen) >= 4
    viscous = np.array([joint["viscous"] or 0.0 for joint in found])
    np.testing.assert_allclose(viscous[seen], more[seen], rtol=0.1)
    printed = capsys.readouterr().out
    assert "for the scenario" in printed
    assert f"coulomb: [{coulomb[0]:.4g}, " in printed


def test_a_joint_that_hardly_moves_has_no_number(folder, capsys, tmp_path):
    with np.load(folder / "log.npz") as log:
        values = dict(log)
    values["six/v"] = values["six/v"].copy()
    values["six/v"][:, 2] = np.abs(values["six/v"][:, 2])  # one way only
    np.savez(tmp_path / "log.npz", **values)
    arguments = ("identify", "--friction", str(tmp_path), "--scenario")
    assert cli.main((*arguments, str(folder / "scenario.yaml"))) == 0
    (row,) = (s for s in capsys.readouterr().out.splitlines() if s.startswith("elbow"))
    assert row.split() == ["elbow", "not", "seen", "inf", "not", "seen", "inf"]


def test_what_cannot_be_read_is_said(folder, capsys, tmp_path):
    with np.load(folder / "log.npz") as log:
        short = {key: value[:40] if len(value) > 40 else value for key, value in log.items()}
    np.savez(tmp_path / "log.npz", **short)
    (tmp_path / "scenario.yaml").write_bytes((folder / "scenario.yaml").read_bytes())
    assert cli.main(("identify", "--friction", str(tmp_path))) == 2
    assert "The log has 40 rows" in capsys.readouterr().err
    (tmp_path / "scenario.yaml").write_text("experiment: bar\n", encoding="utf-8")
    assert cli.main(("identify", "--friction", str(tmp_path))) == 2
    assert "The scenario has two arms" in capsys.readouterr().err
