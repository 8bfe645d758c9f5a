"""Objects in a picture, as `factorlab objects` tells them: by colour, or by a network of the user's."""

from factorlab.objects.document import objects_document
from factorlab.objects.exports import object_files
from factorlab.objects.found import (
    COLOURS,
    Found,
    Item,
    NetworkSettings,
    by_colour,
    by_network,
    colour_of,
)

__all__ = [
    "COLOURS",
    "Found",
    "Item",
    "NetworkSettings",
    "by_colour",
    "by_network",
    "colour_of",
    "object_files",
    "objects_document",
]
