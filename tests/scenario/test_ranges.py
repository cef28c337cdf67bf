"""Every number and every name of every scenario has a range; what is beyond it gets one line."""

import re

import pytest

from geoimp_drake.diagrams.experiments.catalogue import EXPERIMENTS
from geoimp_drake.errors import GeoimpError
from geoimp_drake.scenario.loading import plain_data

# One of each set-up has every key.
SET_UPS = ("redundancy", "peg_in_hole", "bar")


def leaves(data, path=""):
    if isinstance(data, dict | list):
        parts = data.items() if isinstance(data, dict) else enumerate(data)
        for key, part in parts:
            yield from leaves(part, f"{path}.{key}" if path else str(key))
    else:
        yield path, data


def paths(kind: type) -> list[tuple[str, str]]:
    """The places of all values of a type, of a list the first one only."""
    return [
        (name, path)
        for name in SET_UPS
        for path, value in leaves(plain_data(EXPERIMENTS[name].scenario()))
        if type(value) is kind and not re.search(r"\.[1-9]", path)
    ]


NUMBERS, WHOLE, TEXTS = paths(float), paths(int), paths(str)


def refusal(name: str, path: str, value: str) -> str:
    with pytest.raises(GeoimpError) as raised:  # a warning of NumPy's is another error
        EXPERIMENTS[name].scenario((), (f"{path}={value}",))
    return str(raised.value)


def test_the_scenarios_have_numbers_and_names():
    assert (len(NUMBERS) > 150, len(WHOLE) > 3, len(TEXTS) > 20) == (True, True, True)


@pytest.mark.parametrize(
    ("name", "path", "value"),
    [*((*place, "1e13") for place in NUMBERS), (*NUMBERS[0], "9" * 100)],
)
def test_no_number_is_so_large_that_its_square_overflows(name, path, value):
    said = refusal(name, path, value)
    assert len(said) < 400
    assert len(said.splitlines()) == 1
    assert path.removesuffix(".0") in said or "steps of" in said


@pytest.mark.parametrize("value", [str(2**128), "1" + 400 * "0"])
@pytest.mark.parametrize(("name", "path"), WHOLE)
def test_no_whole_number_is_too_large_for_an_index(name, path, value):
    assert re.search(f"^{path} .*(at most 18 digits|give)", refusal(name, path, value))


@pytest.mark.parametrize(("name", "path"), NUMBERS)
def test_a_denormal_number_is_refused_or_as_good_as_zero(name, path):
    """Where it would be divided by, it is refused; elsewhere it gives what zero gives."""
    try:
        tiny = EXPERIMENTS[name].scenario((), (f"{path}=1e-310",))
    except GeoimpError:
        return
    zero = EXPERIMENTS[name].scenario((), (f"{path}=0.0",))
    assert plain_data(zero).keys() == plain_data(tiny).keys()


@pytest.mark.parametrize("value", ["x" * 10**5, '"a\\nb"', '"\\e[2J"'])
@pytest.mark.parametrize(("name", "path"), TEXTS)
def test_no_text_is_longer_than_a_name_or_more_than_a_line(name, path, value):
    said = refusal(name, path, value)
    assert len(said) < 400
    assert said.isprintable()
    assert said.startswith(path)
