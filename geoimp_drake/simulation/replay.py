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
        host: address at which browsers can connect, `*` for all addresses of this machine; by
            default only programs of this machine can connect.

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
    """Lets a Meshcat record from now on, for a replay."""
    meshcat.StartRecording(frames_per_second=32.0, set_visualizations_while_recording=False)


def stop_listening(meshcat: Meshcat) -> None:
    """Closes a Meshcat to browsers; it still draws and records.

    Drake's Meshcat listens as long as it lives. It lives as long as the process, because the
    diagram and the blocks that draw on it keep each other alive. So this function puts an
    unconnected socket in the place of the listening one. It keeps the descriptor's number, which
    Drake closes in the end.
    """
    (descriptor,) = (
        number for number in map(int, os.listdir("/dev/fd")) if _listens(number, meshcat.port())
    )
    with socket.socket() as unconnected:
        os.dup2(unconnected.fileno(), descriptor, inheritable=False)


def _listens(descriptor: int, port: int) -> bool:
    try:
        # `fromfd` would leave its copy open if this is no socket.
        if not stat.S_ISSOCK(os.fstat(descriptor).st_mode):
            return False
        with socket.fromfd(descriptor, socket.AF_INET, socket.SOCK_STREAM) as copy:
            listens = copy.getsockopt(socket.SOL_SOCKET, socket.SO_ACCEPTCONN)
            return bool(listens) and copy.getsockname()[1:2] == (port,)
    except OSError:  # it has been closed meanwhile
        return False
