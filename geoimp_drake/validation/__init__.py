"""Checks of a user's configuration; each error names the field and the number."""

from geoimp_drake.validation.values import (
    LARGEST,
    LARGEST_SEED,
    choice,
    finite_array,
    finite_vector,
    key,
    non_negative,
    positive,
    positive_vector,
    quoted,
    spd_matrix,
    symmetric,
    unknown_name,
    whole_number,
)
from geoimp_drake.validation.walk import (
    PATH,
    UNBOUNDED,
    check,
    check_data,
    field_types,
    without_optional,
)

__all__ = [
    "LARGEST",
    "LARGEST_SEED",
    "PATH",
    "UNBOUNDED",
    "check",
    "check_data",
    "choice",
    "field_types",
    "finite_array",
    "finite_vector",
    "key",
    "non_negative",
    "positive",
    "positive_vector",
    "quoted",
    "spd_matrix",
    "symmetric",
    "unknown_name",
    "whole_number",
    "without_optional",
]
