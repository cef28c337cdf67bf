"""Where processes wait for connections, as the system tells it."""

from collections.abc import Iterable

import psutil

Address = tuple[str, int]


def listening(processes: Iterable[int]) -> set[Address]:
    """The addresses, host and port, at which processes listen."""
    return {
        (connection.laddr.ip, connection.laddr.port)
        for process in processes
        for connection in psutil.Process(process).net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    }
