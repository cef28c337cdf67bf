"""The springs as a part of a report: no simulation, two tables and a figure."""

import pytest

from geoimp_drake.diagrams.experiments.springs_section import SpringsSection


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    out = tmp_path_factory.mktemp("springs")
    result = SpringsSection().run(out, 1, ())
    assert {path.name for path in out.iterdir()} == set(SpringsSection.files)
    return result


def test_each_spring_has_a_row_of_numbers_and_a_source(result):
    numbers, sources = result.tables
    assert [row[0] for row in numbers.rows] == [row[0] for row in sources.rows]
    assert all(row[2] for row in sources.rows)
    work = {row[0]: row[1] for row in numbers.rows}
    assert work["quaternion (ours)"] == "< 0.001"  # J a lap; what the steps of the sum leave
    assert -5.5 < float(work["axis-angle"]) < -5.0
    assert -4.5 < float(work["cross products"]) < -4.0


def test_no_rounding_is_shown_as_a_number(result):
    cells = [cell for row in result.tables[0].rows for cell in row]
    assert not [cell for cell in cells if "e-" in cell]
