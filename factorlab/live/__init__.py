"""What comes in while a program runs: the serial port of a board."""

from factorlab.live.recorder import RecordSettings, record_serial
from factorlab.live.serial_port import PortLostError, SerialPort
from factorlab.live.summary import Recorded

__all__ = ["PortLostError", "RecordSettings", "Recorded", "SerialPort", "record_serial"]
