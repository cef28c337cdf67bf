"""The Meshcat that shows a run or records its replay."""

import logging
import os
import socket
import stat

from pydrake.geometry import Meshcat, MeshcatParams

from geoimp_drake.errors import ConfigurationError

__all__ = ["start_meshcat", "start_recording", "stop_listening"]

_LOOPBACK = "127.0.0.1"


def start_meshcat(
    camera: tuple[float, float, float],
    target: tuple[float, float, float],
    *,
    host: str | None = None,
) -> Meshcat:
    """Returns a Meshcat whose camera looks from a point in W to another.

    Args:
        camera: where it stands [m].
        target: what it looks at [m].
        host: address at which browsers are waited for, `*` for every one that this machine has; by
            default programs of this machine alone can connect.

    Raises:
        ConfigurationError: the host is no address of this machine.
    """
    level = logging.getLogger("drake").level
    logging.getLogger("drake").setLevel(logging.WARNING)  # the server's address is of no use here
    try:
        meshcat = Meshcat(MeshcatParams(host=host or _LOOPBACK))
    except RuntimeError:
        raise ConfigurationError(
            f"Meshcat cannot listen at {host or _LOOPBACK}: it is not an address of this machine, "
            "or its ports 7000 to 7999 are all taken."
        ) from None
    finally:
        logging.getLogger("drake").setLevel(level)
    meshcat.SetCameraPose(camera, target)
    meshcat.SetProperty("/Background", "top_color", [0.93, 0.95, 0.97])
    meshcat.SetProperty("/Background", "bottom_color", [0.80, 0.84, 0.88])
    return meshcat


def start_recording(meshcat: Meshcat) -> None:
    """Has a Meshcat record what is drawn on it from now on, for a replay."""
    meshcat.StartRecording(frames_per_second=32.0, set_visualizations_while_recording=False)


def stop_listening(meshcat: Meshcat) -> None:
    """Has a Meshcat wait for browsers no longer; it draws and records all the same.

    Drake records on a Meshcat that listens as long as it lives, and it lives as long as the
    process, for the diagram and the blocks that draw on it keep each other. So the socket is
    replaced, under its number, which stays Drake's to close, by one that is connected to nothing.
    """
    (descriptor,) = (
        number for number in map(int, os.listdir("/dev/fd")) if _listens(number, meshcat.port())
    )
    with socket.socket() as unconnected:
        os.dup2(unconnected.fileno(), descriptor, inheritable=False)


def _listens(descriptor: int, port: int) -> bool:
    try:
        # `fromfd` would leave its copy of what is no socket open.
        if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
            return False
        with socket.fromfd(descriptor, socket.AF_INET, socket.SOCK_STREAM) as copy:
            listens = copy.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)
            return bool(listens) and copy.getsockname()[1:2] == (port,)
    except OSError:  # it is closed again
        return False
