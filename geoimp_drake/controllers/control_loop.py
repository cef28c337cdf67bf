"""The impedance controller without a simulator: torques from readings, tick by tick."""

from collections.abc import Sequence

from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import Frame, ModelInstanceIndex

from geoimp_drake.controllers.arm_loop import ArmLoop
from geoimp_drake.controllers.config import ImpedanceControllerConfig
from geoimp_drake.controllers.impedance_controller import controller_parts
from geoimp_drake.controllers.safety import refuse_safety
from geoimp_drake.errors import SignalError
from geoimp_drake.parts.impedance import Impedance
from geoimp_drake.parts.impedance_controller import ImpedanceController
from geoimp_drake.task_functions.task_function import TaskFunction
from geoimp_drake.typing import Array

__all__ = ["ControlLoop"]


class ControlLoop(ArmLoop):
    """The controller of `make_impedance_controller`, called by hand at each tick of a robot.

    It takes what a robot reports and returns the torques for it, in the robot's own order of
    joints. It runs the part of which the form `compiled` makes a system. C is integrated by
    explicit Euler over the time between ticks.

    Args:
        plant: finalized, contains the arm as `make_impedance_controller` wants it.
        model_instance: the arm.
        end_effector_frame: E, the frame that is made compliant.
        config: gains, orientation family and sampling; by default the chapter's first experiment.
            `form` has no effect.
        gravity: who holds the arm's weight: `controller`, or `robot`, which adds it to the torques
            that it receives, as iiwa, Franka and UR do.
        joints: the joints' names in the robot's order; by default that from base to hand.
        task_function: of a redundant arm, in place of the configured one.

    Attributes:
        config: gains, orientation family and sampling.
        model: the arm; it has no weight if the robot holds it.
        impedance: of the end effector.
        joints: the order of q, v and torques.
        period: of a tick, unless `step` is told another [s].
        gravity: who holds the arm's weight.
        gives: what `step` returns, `torque`.

    Raises:
        ModelError: the plant does not contain such an arm.
        ConfigurationError: the configuration cannot be used, or `joints` are not those of the arm.
    """

    gives = "torque"

    def __init__(
        self,
        plant: MultibodyPlant,
        model_instance: ModelInstanceIndex,
        end_effector_frame: Frame,
        config: ImpedanceControllerConfig | None = None,
        *,
        gravity: str = "controller",
        joints: Sequence[str] | None = None,
        task_function: TaskFunction | None = None,
    ):
        self.config = config = config or ImpedanceControllerConfig()
        refuse_safety(config)
        impedance, arm = controller_parts(
            plant,
            model_instance,
            end_effector_frame,
            config,
            task_function,
            gravity=gravity,
        )
        self.gravity = gravity
        self.impedance = impedance if isinstance(impedance, Impedance) else impedance.springs
        self._needs_wrench = impedance.needs_wrench
        passivity = config.make_passivity(impedance)
        part = ImpedanceController(impedance, arm.loop(), passivity=passivity)
        name = f"{plant.GetModelInstanceName(model_instance)}_control_loop"
        super().__init__(part, name, arm.model, joints, config.sampling.period)
        self._let_change(self.impedance, passivity)
        self._reading = self._loop.input("estimated_state")

    def reset(
        self, q: Array, v: Array, wrench: Array | None = None, desired: Array | None = None
    ) -> Array:
        """Starts C at rest on the measured pose of E; returns the torques as `step` does.

        Args:
            q: joint positions (n) [rad, m].
            v: joint velocities (n) [rad/s, m/s].
            wrench: h by the end effector on the environment, about Eo, in W (6); zero by default.
            desired: motion of D in W (19); at rest on E by default.

        Raises:
            SignalError: a signal cannot be used.
        """
        self._start(q, v, wrench, desired)
        return self.joints.torques(self._loop.output("actuation"))

    def step(
        self, q: Array, v: Array, wrench: Array | None, desired: Array, dt: float | None = None
    ) -> Array:
        """Returns the torques of the next tick (n) [Nm, N].

        Args:
            q: joint positions (n) [rad, m].
            v: joint velocities (n) [rad/s, m/s].
            wrench: h by the end effector on the environment, about Eo, in W (6) [Nm, N]; natural
                inertia needs none.
            desired: motion of D in W, see `frame_motion` (19).
            dt: time since the last tick [s]; the period of sampling by default.

        Raises:
            SignalError: a signal is not finite or of another size, or no time has passed.
            SingularityError: six joints exactly singular without limits, or an attitude leaves
                the domain of its law.
        """
        self.joints.reading(q, v, self._reading)
        elapsed = self.period if dt is None else dt
        if wrench is None and self._needs_wrench:
            raise SignalError("step() got no wrench; only natural inertia can do without one.")
        readings = {} if wrench is None else {"wrench": wrench}
        self._loop.step(readings, {"desired_motion": desired}, elapsed)
        return self.joints.torques(self._loop.output("actuation"))
