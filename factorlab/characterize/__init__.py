"""What `factorlab characterize` knows: readings by axis, noise declared and measured, a verdict in words."""

from factorlab.characterize.channels import Channel, channels_of, read_columns
from factorlab.characterize.declared import Declared
from factorlab.characterize.engine import Study, study

__all__ = ["Channel", "Declared", "Study", "channels_of", "read_columns", "study"]
