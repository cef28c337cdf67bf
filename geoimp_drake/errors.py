"""The errors that this library raises: each names the cause, the number and what to do."""

__all__ = [
    "ConfigurationError",
    "GeoimpError",
    "ModelError",
    "OutOfDomainError",
    "SignalError",
    "SingularityError",
]


class GeoimpError(ValueError):
    """Base of every error that this library raises on purpose."""


class ConfigurationError(GeoimpError):
    """A gain, scenario field, name or file cannot be used."""


class ModelError(GeoimpError):
    """The plant does not contain the arm, joint or frame needed, or not of the right kind."""


class SignalError(GeoimpError):
    """A value at a port breaks the port's contract: NaN, infinite or not a unit quaternion."""


class SingularityError(GeoimpError):
    """A posture or an attitude is at a singularity of the kinematics or of the Euler angles."""


class OutOfDomainError(SingularityError):
    """A relative orientation has left the domain in which its representation is defined."""
