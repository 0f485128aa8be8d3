"""Check within a few seconds whether a Dask scheduler can be reached; Dask would try for longer and log errors."""

from __future__ import annotations

import queue
import re
import socket
import struct
import threading

from ..errors import InputError, MachineError

CONNECT = 4.0  # seconds to resolve the name and to connect
PROTOCOLS = ("tcp", "tls", "ws", "wss", "ucx", "ucxx", "inproc")
MAX_GREETING = 1 << 20  # maximum size of the first message in bytes; usually, it has a few hundred
CHECKED = ("tcp", "tls", "ws", "wss")  # protocols over a socket
ADDRESS = re.compile(r"(?:(?P<protocol>\w+)://)?(?P<host>[^/\s]+):(?P<port>\d{1,5})/?")


def check(address: str) -> None:
    """Raise InputError for an invalid address, MachineError if no scheduler answers there within `CONNECT` seconds."""
    hint = "give one such as tcp://10.0.0.7:8786; `dask scheduler` prints its own"
    protocol, separator, _ = address.partition("://")
    if separator and protocol not in PROTOCOLS:
        raise InputError(f"'{address}' is not a scheduler address: unknown protocol '{protocol}'", "--cluster", hint)
    if separator and protocol not in CHECKED:
        return
    match = ADDRESS.fullmatch(address)
    if match is None or not 0 < int(match["port"]) < 1 << 16:
        raise InputError(f"'{address}' is not a scheduler address", "--cluster", hint)
    greets = protocol == "tcp" or not separator  # other protocols begin with a TLS or HTTP handshake
    reason = _unreachable(match["host"].strip("[]"), int(match["port"]), greets)
    if reason:
        raise MachineError(f"no scheduler answers: {reason}", address, "is it running, and is this its address?")


def _unreachable(host: str, port: int, greets: bool) -> str:
    """The reason why no connection can be made; "" if a connection can be made.

    The attempt runs in a thread, because name resolution has no timeout.

    greets  whether the scheduler begins by sending the length of its first message, in 8 bytes
    """
    answers: queue.Queue[str] = queue.Queue()

    def connect() -> None:
        try:
            with socket.create_connection((host, port), timeout=CONNECT) as connection:
                first = connection.recv(8, socket.MSG_WAITALL) if greets else b""
            known = not greets or (len(first) == 8 and struct.unpack("Q", first)[0] < MAX_GREETING)
            answers.put("" if known else "the program that answers is not a Dask scheduler")
        except (OSError, UnicodeError) as error:
            answers.put(getattr(error, "strerror", None) or str(error))

    threading.Thread(target=connect, daemon=True).start()
    try:
        return answers.get(timeout=CONNECT)
    except queue.Empty:
        return f"no answer in {CONNECT:g} s"
