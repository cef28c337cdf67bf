"""An error in a scenario names the file and the line of the key, unless an option gave it."""

import pytest

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.scenario.loading import read_layer

FILE = """seed: 1
impedance:
  translation:
    mass: {mass}
    {key}: 700
segments:
- {{duration: 1.0}}
- {{duration: {duration}, name: {name}}}
surface: null
sampling: {{period: {period}}}
"""


def scenario(tmp_path, overrides=(), mass=9, key="stiffness", duration=2, name="a", period=0.001):
    file = tmp_path / "mine.yaml"
    file.write_text(FILE.format(mass=mass, key=key, duration=duration, name=name, period=period))
    return EXPERIMENTS["plexiglas"].scenario((read_layer(file),), overrides)


@pytest.mark.parametrize(
    ("values", "line", "message"),
    [
        ({"mass": -1}, 4, "impedance.translation.mass is not positive definite"),
        ({"mass": "heavy"}, 4, "impedance.translation.mass is 'heavy'"),
        ({"key": "stifness"}, 5, "Unknown key in impedance.translation 'stifness'"),
        ({"duration": "soon"}, 8, "segments.1.duration is 'soon'"),
        ({"duration": -2}, 8, "segments.1.duration is -2 s"),
        ({"name": "x" * 101}, 8, "segments.1.name is 'xxx.*101 characters"),
        ({"mass": 1e13}, 4, "impedance.translation.mass is 1[^;]*; give numbers of at most 1e.12"),
        ({"period": 0}, 10, "sampling.period is 0 s"),
    ],
)
def test_an_error_has_the_file_and_the_line_of_the_key(values, line, message, tmp_path):
    with pytest.raises(ConfigurationError, match=rf"^\S*mine\.yaml, line {line}: {message}"):
        scenario(tmp_path, **values)


def test_what_an_option_gave_has_no_line(tmp_path):
    with pytest.raises(ConfigurationError, match=r"^sampling\.period is -1 s"):
        scenario(tmp_path, ("sampling.period=-1",), period=0)
    with pytest.raises(ConfigurationError, match=r"^impedance\.translation\.mass is -?1"):
        scenario(tmp_path, ("impedance.translation={mass: 1e20}",))


@pytest.mark.parametrize("whole", ["0.1", "x", "[1]", "null"])
def test_a_part_of_what_an_option_has_replaced_is_refused_or_made(whole):
    given = (f"surface={whole}", "surface.point=[0.9, 0.0, 0.5]")
    if whole == "null":
        assert EXPERIMENTS["plexiglas"].scenario((), given).surface.point[2] == 0.5
        return
    with pytest.raises(ConfigurationError, match=r"^surface (is|has) .*'point' is no"):
        EXPERIMENTS["plexiglas"].scenario((), given)
