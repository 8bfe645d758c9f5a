"""Match two pictures and say what geometry they share: the job behind `factorlab match`."""

from factorlab.match.document import match_document
from factorlab.match.job import Matched, match_pictures
from factorlab.match.settings import METHODS, MODELS, MatchSettings

__all__ = ["METHODS", "MODELS", "MatchSettings", "Matched", "match_document", "match_pictures"]
