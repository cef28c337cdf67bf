"""What the output ports of a system say, and how far two systems are apart."""

import numpy as np
from pydrake.systems.framework import Context, System


def ports(system: System, context: Context) -> dict[str, np.ndarray]:
    """Returns what each output port says."""
    outputs = map(system.get_output_port, range(system.num_output_ports()))
    return {port.get_name(): port.Eval(context).copy() for port in outputs}


def largest_difference(ours: dict[str, np.ndarray], others: dict[str, np.ndarray]) -> float:
    """Returns the largest difference relative to the largest entry of its port, or to 0.01."""
    assert ours.keys() == others.keys()
    away = {
        name: float(np.abs(ours[name] - value).max() / max(np.abs(value).max(), 1e-2))
        for name, value in others.items()
    }
    worst = max(away, key=lambda name: away[name])
    print(f"largest difference: {worst}, {away[worst]:.1e}")
    return away[worst]
