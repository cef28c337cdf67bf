"""What Drake raises, and where it would end the process, becomes an error of this library."""

import pytest
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.analysis import SimulatorConfig
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import ConstantVectorSource, Saturation

from geoimp_drake import cli
from geoimp_drake.errors import ConfigurationError, ModelError, drake_errors
from geoimp_drake.simulation.run import Event, simulate


def abort(*_) -> None:
    """Fails an assertion in C++, by which Drake ends the process."""
    Saturation(min_value=[1.0], max_value=[0.0])


def test_an_abort_is_one_line_without_the_path_of_drakes_build():
    with pytest.raises(ModelError) as raised, drake_errors(ModelError, "arm.urdf"):
        abort()
    said = str(raised.value)
    assert said.startswith("arm.urdf: condition '(min_value_.array() <= ")
    assert said.endswith("failed. (saturation.cc:64 in Saturation())")


def test_what_drake_raises_becomes_the_error_asked_for_and_ours_passes():
    with (
        pytest.raises(ConfigurationError, match=r"arm: .*RigidBodyIndex"),
        drake_errors(ConfigurationError, "arm"),
    ):
        MultibodyPlant(1e-3).get_body(BodyIndex(77))
    with pytest.raises(ModelError, match=r"^ours$"), drake_errors(ConfigurationError, "arm"):
        raise ModelError("ours")


@pytest.mark.parametrize("code", [2, None, "bye"])
def test_anybody_elses_exit_passes(code):
    with pytest.raises(SystemExit), drake_errors(ModelError, "arm"):
        raise SystemExit(code)


def test_an_abort_ends_a_simulation_like_any_other_error():
    builder = DiagramBuilder()
    builder.AddSystem(ConstantVectorSource([1.0]))
    outcome = simulate(builder.Build(), SimulatorConfig(), 0.2, events=[Event(0.1, abort)])
    assert isinstance(outcome.failure, ModelError)
    assert outcome.time == pytest.approx(0.1)


def test_an_abort_in_a_command_is_one_line_and_status_2(monkeypatch, capsys):
    class Parser:
        def parse_args(self, arguments):
            return type("Options", (), {"command": abort})

    monkeypatch.setattr(cli, "make_parser", Parser)
    assert cli.main([]) == 2
    said = capsys.readouterr().err
    assert said.startswith("geoimp: ")
    assert said.count("\n") == 1
