"""The simulated line follower while it drives: a page on this computer whose sliders change it."""

from factorlab.live.follower.account import document_of
from factorlab.live.follower.own_detector import OwnDetector
from factorlab.live.follower.server import FollowerServer, csv_of
from factorlab.live.follower.session import FollowerSession
from factorlab.live.follower.state import state_of, summary_of

__all__ = [
    "FollowerServer",
    "FollowerSession",
    "OwnDetector",
    "csv_of",
    "document_of",
    "state_of",
    "summary_of",
]
