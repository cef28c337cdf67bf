"""Gains of the internal impedance that do not follow from any arms."""

import numpy as np

from geoimp_drake.parts.internal_impedance import InternalGains, InternalImpedanceConfig


def bar_internal(**fields) -> InternalImpedanceConfig:
    """Returns those of the experiment `bar`."""
    gains = {
        "translation": InternalGains(np.array(10.0), np.array(400.0), np.array(2000.0)),
        "rotation": InternalGains(np.array(0.3), np.array(12.0), np.array(100.0)),
    }
    return InternalImpedanceConfig(**{**gains, **fields})
