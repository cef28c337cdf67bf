"""What a table of a report shows of a number."""

import pytest

from geoimp_drake.campaigns.table import cell_of, table_of


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (None, "–"),
        ("2 %", "2 %"),
        (200, "200"),
        (0.0, "0"),
        (6.3e-5, "< 0.001"),
        (-2.7e-14, "< 0.001"),
        (1e-3, "0.001"),
        (0.38249, "0.382"),
        (-4.364, "-4.36"),
        (131.98, "132"),
        (999.7, "1000"),
        (20345.6, "20346"),
    ],
)
def test_a_cell_shows_three_digits_without_an_exponent(value, shown):
    assert cell_of(value) == shown


def test_a_table_has_the_columns_that_are_asked_for():
    table = table_of("title", [{"a": 1.0, "b": None, "c": "x"}], ("b", "a"))
    assert (table.head, table.rows) == (("b", "a"), (("–", "1"),))
