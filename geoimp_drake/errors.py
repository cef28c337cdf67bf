"""The errors that this library raises: each names the cause, the number and what to do."""

import contextlib
import re
from collections.abc import Iterator

__all__ = [
    "ConfigurationError",
    "ConversionError",
    "GeoimpError",
    "MissingPackageError",
    "ModelError",
    "OutOfDomainError",
    "OutputError",
    "SignalError",
    "SingularityError",
    "drake_errors",
    "one_line",
]

# The exceptions that pydrake raises for those of C++.
DRAKE_RAISES = (RuntimeError, ValueError, IndexError)
_LONGEST = 4000  # characters of a message
_ABORT = re.compile(
    r"(abort: )?Failure at \S*?(?P<where>[^/\s]+ in .+?\(\)): (?P<what>.*)", re.DOTALL
)


class GeoimpError(ValueError):
    """Base of every error that this library raises on purpose."""


class ConfigurationError(GeoimpError):
    """A gain, scenario field, name or file cannot be used.

    Attributes:
        key: path of the field in the configuration, empty if it is not known.
    """

    key = ""


class MissingPackageError(ConfigurationError):
    """A package that one of this project's extras brings is not installed, or does not work."""


class OutputError(GeoimpError):
    """Results could not be written, as on a full disk; what was written before is kept."""


class ConversionError(GeoimpError):
    """A system has no form for `AutoDiffXd`, or no linearization.

    Args:
        what: the system and why, as the beginning of a sentence.
    """

    def __init__(self, what: str):
        super().__init__(
            f"{what}; it has no derivatives by AutoDiffXd. `geoimp analyze` predicts loops that "
            f"sample and discrete or hydroelastic contact."
        )


class ModelError(GeoimpError):
    """The plant does not contain the arm, joint or frame needed, or not of the right kind."""


class SignalError(GeoimpError):
    """A value at a port breaks the port's contract: NaN, infinite or not a unit quaternion."""


class SingularityError(GeoimpError):
    """A posture or an attitude is at a singularity of the kinematics or of the Euler angles."""


class OutOfDomainError(SingularityError):
    """A relative orientation has left the domain in which its representation is defined."""


@contextlib.contextmanager
def drake_errors(
    kind: type[GeoimpError], what: str, raised: tuple[type[Exception], ...] = DRAKE_RAISES
) -> Iterator[None]:
    """Turns an exception of Drake into a one-line error of this library.

    Args:
        kind: class of the error; an error that already is this library's passes unchanged.
        what: stands before Drake's own words: the user's file or arm.
        raised: the exceptions to turn, besides the SystemExit by which Drake would end the process
            when one of its own assertions fails. Any other SystemExit passes.
    """
    caught: tuple[type[BaseException], ...] = (SystemExit, *raised)
    try:
        yield
    except GeoimpError:
        raise
    except caught as error:
        failed = _ABORT.match(str(error))
        if isinstance(error, SystemExit) and failed is None:
            raise
        said = str(error) if failed is None else f"{failed['what']} ({failed['where']})"
        raise kind(f"{what}: {one_line(said)}") from error


def one_line(message: object) -> str:
    """Returns a message in one line that a terminal shows as it is, its middle left out if long."""
    line = " ".join(str(message).split())
    if len(line) > _LONGEST:
        line = f"{line[: _LONGEST // 2]} … {line[-_LONGEST // 2 :]}"
    return "".join(c if c.isprintable() else ascii(c)[1:-1] for c in line)
