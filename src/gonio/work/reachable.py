"""Whether a Dask scheduler can be reached, found out in a few seconds: Dask itself tries for longer, and logs."""

from __future__ import annotations

import queue
import re
import socket
import struct
import threading

from ..errors import InputError, MachineError

CONNECT = 4.0  # seconds for a name to be looked up and a connection to be made
PROTOCOLS = ("tcp", "tls", "ws", "wss", "ucx", "ucxx", "inproc")
LONGEST = 1 << 20  # bytes of the first message: it is a few hundred
CHECKED = ("tcp", "tls", "ws", "wss")  # those of a socket
ADDRESS = re.compile(r"(?:(?P<protocol>\w+)://)?(?P<host>[^/\s]+):(?P<port>\d{1,5})/?")


def check(address: str) -> None:
    """Raise InputError for what is no address of a scheduler, MachineError where nothing answers there in `CONNECT`
    seconds."""
    hint = "give one such as tcp://10.0.0.7:8786; `dask scheduler` prints its own"
    protocol, separator, _ = address.partition("://")
    if separator and protocol not in PROTOCOLS:
        raise InputError(f"'{address}' is no address of a scheduler: '{protocol}' is no protocol", "--cluster", hint)
    if separator and protocol not in CHECKED:
        return
    match = ADDRESS.fullmatch(address)
    if match is None or not 0 < int(match["port"]) < 1 << 16:
        raise InputError(f"'{address}' is no address of a scheduler", "--cluster", hint)
    greets = protocol == "tcp" or not separator  # of the others, encryption or HTTP comes first
    reason = _unreachable(match["host"].strip("[]"), int(match["port"]), greets)
    if reason:
        raise MachineError(f"no scheduler answers: {reason}", address, "is it running, and is this its address?")


def _unreachable(host: str, port: int, greets: bool) -> str:
    """Why no connection can be made, "" where one can. In a thread, as looking up a name has no limit of its own.

    greets  a scheduler begins with the length of its first message, 8 bytes
    """
    answers: queue.Queue[str] = queue.Queue()

    def connect() -> None:
        try:
            with socket.create_connection((host, port), timeout=CONNECT) as connection:
                first = connection.recv(8, socket.MSG_WAITALL) if greets else b""
            known = not greets or (len(first) == 8 and struct.unpack("Q", first)[0] < LONGEST)
            answers.put("" if known else "what answers there is no Dask scheduler")
        except (OSError, UnicodeError) as error:
            answers.put(getattr(error, "strerror", None) or str(error))

    threading.Thread(target=connect, daemon=True).start()
    try:
        return answers.get(timeout=CONNECT)
    except queue.Empty:
        return f"no answer in {CONNECT:g} s"
