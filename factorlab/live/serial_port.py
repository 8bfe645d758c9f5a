"""A serial port, whose failures are sentences."""

from __future__ import annotations

import errno
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from sequential.errors import DataError

if TYPE_CHECKING:
    from serial import Serial

__all__ = ["PortLostError", "SerialPort"]

PATIENCE_S = 0.05  # how long `receive` waits for a first byte
SPEEDS = (500_000, 250_000, 115_200, 1_000_000)  # the firmware's own first, then what else it is built for


class PortLostError(DataError):
    """The port went away while it was read: the board was unplugged."""


class SerialPort:
    """An open port, for as long as the block lasts; nobody else can open it meanwhile.

    Parameters
    ----------
    name : `/dev/ttyUSB0`, `COM3`, or any address that pyserial knows, such as `socket://host:port`
    baud : bits a second; by default the firmware's, and `next_speed` tries others

    Raises
    ------
    DataError
        when it is opened: pyserial is not installed, or the port is missing, busy, not permitted, no port.
    """

    def __init__(self, name: str, baud: int | None = None) -> None:
        self.name = name
        self._speeds = SPEEDS if baud is None else (baud,)
        self._at = 0
        self._port: Serial | None = None

    def __enter__(self) -> Self:
        try:
            import serial
        except ImportError as fault:
            raise DataError("reading a serial port needs pyserial; pip install 'factorlab[live]'") from fault
        # an address has no lock; a device has
        options: dict[str, Any] = {} if "://" in self.name else {"exclusive": True}
        try:
            self._port = serial.serial_for_url(
                self.name, baudrate=self._speeds[0], timeout=PATIENCE_S, write_timeout=1.0, **options
            )
        except (serial.SerialException, OSError, ValueError) as fault:
            raise DataError(_why(self.name, self._speeds[0], fault)) from fault
        return self

    def __exit__(
        self, kind: type[BaseException] | None, fault: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._port is not None:
            self._port.close()

    @property
    def tried(self) -> str:
        """The speeds so far, bit/s."""
        return ", ".join(map(str, self._speeds[: self._at + 1]))

    def next_speed(self) -> bool:
        """Go on to another speed, where there is one; what came at the old one is dropped."""
        if self._at + 1 == len(self._speeds):
            return False
        self._at += 1
        assert self._port is not None  # noqa: S101 - used inside its block
        try:
            self._port.baudrate = self._speeds[self._at]
            self._port.reset_input_buffer()
        except (OSError, ValueError):  # this port cannot have it
            return self.next_speed()
        return True

    def receive(self) -> bytes:
        """Give what has come, after at most 50 ms; empty where nothing did. Raises `PortLostError`."""
        assert self._port is not None  # noqa: S101 - used inside its block
        try:
            first = self._port.read(1)
            return bytes(first + self._port.read(self._port.in_waiting)) if first else b""
        except OSError as fault:  # SerialException is one
            raise PortLostError(f"the port {self.name} went away: {_text(fault)}") from fault

    def send(self, data: bytes) -> None:
        """Write commands. Raises `PortLostError`."""
        import serial

        assert self._port is not None  # noqa: S101 - used inside its block
        try:
            self._port.write(data)
        except serial.SerialTimeoutException:
            return  # nobody reads: what comes, or does not, will tell
        except OSError as fault:
            raise PortLostError(f"the port {self.name} went away: {_text(fault)}") from fault


def _why(name: str, baud: int, fault: Exception) -> str:
    """What is wrong with a port that cannot be opened, and what to do."""
    code = getattr(fault, "errno", None)
    text = _text(fault)
    if code == errno.ENOENT or "FileNotFoundError" in text:
        return f"there is no serial port {name}; {_others()}"
    if code == errno.EACCES or "PermissionError" in text:
        return f"no permission to open {name}{_group(name)}"
    if code in {errno.EBUSY, errno.EAGAIN} or "exclusively lock" in text:
        return f"{name} is in use by another program; close its serial monitor"
    if "(25," in text or code == errno.ENOTTY:
        return f"{name} is no serial port; {_others()}"
    if isinstance(fault, ValueError):
        return f"{name} cannot be opened at {baud} bit/s: {text}"
    return f"{name} cannot be opened: {text}"


def _others() -> str:
    from serial.tools import list_ports

    names = [port.device for port in list_ports.comports()]
    return f"there are {', '.join(names)}" if names else "none is there: is the board plugged in?"


def _group(name: str) -> str:
    """The group that may open a device, where the system has such a thing."""
    try:
        group = Path(name).group()
    except (OSError, KeyError, NotImplementedError):
        return ""
    return f"; it belongs to group {group}: sudo usermod -aG {group} $USER, then log in again"


def _text(fault: Exception) -> str:
    return " ".join(str(getattr(fault, "strerror", None) or fault).split())
