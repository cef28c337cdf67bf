"""Distance of a link from a plane."""

import numpy as np
from pydrake.multibody.tree import BodyIndex, JacobianWrtVariable

from geoimp_drake.arm.control_model import ControlModel
from geoimp_drake.errors import ConfigurationError
from geoimp_drake.laws.redundancy.geometric_jacobian import jacobian_rate
from geoimp_drake.task_functions.task_function import Instant, TaskValue
from geoimp_drake.typing import Array
from geoimp_drake.validation import finite_vector, unknown_name

__all__ = ["PlaneDistance"]

_ORIGIN = np.zeros(3)


class PlaneDistance:
    """w = n·p_WL − d, the signed distance of a link's origin L from a plane; k_β > 0 climbs away.

    Args:
        model: the arm.
        link: name of the link.
        normal: n, out of the plane, in W; of any length.
        offset: d; the plane is n·x = d with n of unit length [m].

    Raises:
        ConfigurationError: the link is unknown (the message lists the valid ones), the normal is
            zero, or the offset is not finite.
    """

    def __init__(self, model: ControlModel, link: str, normal: Array, offset: float = 0.0):
        plant = model.plant
        bodies = [plant.get_body(BodyIndex(k)) for k in range(1, plant.num_bodies())]
        links = {body.name(): body for body in bodies}
        if link not in links:
            raise unknown_name(link, "link", links)
        n = finite_vector(normal, "plane distance: normal", 3)
        length = float(np.linalg.norm(n))
        if length < 1e-9:
            raise ConfigurationError("plane distance: normal is zero; give a direction.")
        if not np.isfinite(offset):
            raise ConfigurationError(f"plane distance: offset is {offset}; it must be finite.")
        self._plant, self._normal, self._offset = plant, n / length, offset
        self._frame = links[link].body_frame()

    def evaluate(self, instant: Instant) -> TaskValue:
        """Returns w and its derivatives."""
        scratch, v, n = instant.scratch, instant.v, self._normal
        W = self._plant.world_frame()
        wrt_v = JacobianWrtVariable.kV
        J = self._plant.CalcJacobianSpatialVelocity(scratch, wrt_v, self._frame, _ORIGIN, W, W)
        value = float(n @ self._frame.CalcPoseInWorld(scratch).translation()) - self._offset
        gradient = n @ J[3:]
        return TaskValue(value, float(gradient @ v), gradient, n @ jacobian_rate(J, v)[3:])
