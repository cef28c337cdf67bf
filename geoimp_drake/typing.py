"""Type aliases shared by the whole package."""

import numpy as np

__all__ = ["Array"]

# An array of `float`, or of Drake's `AutoDiffXd` (dtype object): the laws do not decide on types.
# It is not `NDArray[Any]`, which Drake's `yaml_load_typed` does not take as the type of a field.
Array = np.ndarray
