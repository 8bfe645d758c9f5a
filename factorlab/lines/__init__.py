"""The job behind `factorlab line`: read a line in pictures and videos, and say what was read."""

from factorlab.lines.document import line_document
from factorlab.lines.files import line_files
from factorlab.lines.job import LineJob, LineRun, Read, read_lines

__all__ = ["LineJob", "LineRun", "Read", "line_document", "line_files", "read_lines"]
