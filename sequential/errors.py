"""Every error that the project raises, as one small tree.

    FactorlabError
    ├── DataError                 the log or file is at fault
    │   ├── ShapeError            an array has the wrong shape
    │   ├── NotFiniteError        NaN or infinity where a number is needed
    │   ├── TimeOrderError        stamps that go backwards or repeat
    │   ├── GapError              the input stream pauses for too long
    │   ├── MissingStreamError    a stream that the model names is absent or empty
    │   └── FileFormatError       a file that cannot be read as what it claims to be
    ├── ModelError                the declaration is at fault
    │   ├── NotPositiveDefiniteError
    │   ├── NonlinearModelError   an estimator cannot take this model
    │   └── JacobianMismatchError a declared Jacobian disagrees with differences
    ├── SolverError               the solve is at fault
    │   ├── UnderConstrainedError the data leave some variable free
    │   └── NotConvergedError
    └── ToolMissingError          a compiler or an emulator is not installed, or could not do its work

A message is a sentence that says what was expected, what came, where, and what to do.
"""

from __future__ import annotations

__all__ = [
    "DataError",
    "FactorlabError",
    "FileFormatError",
    "GapError",
    "JacobianMismatchError",
    "MissingStreamError",
    "ModelError",
    "NonlinearModelError",
    "NotConvergedError",
    "NotFiniteError",
    "NotPositiveDefiniteError",
    "ShapeError",
    "SolverError",
    "TimeOrderError",
    "ToolMissingError",
    "UnderConstrainedError",
]


class FactorlabError(Exception):
    """Root of the tree: whatever is raised on purpose derives from it."""


class DataError(FactorlabError):
    """The log or the file is at fault."""


class ShapeError(DataError):
    """An array has the wrong shape."""


class NotFiniteError(DataError):
    """NaN or infinity where a number is needed."""


class TimeOrderError(DataError):
    """Stamps that go backwards, or that repeat where they must not."""


class GapError(DataError):
    """The stream that drives the process pauses for longer than the model may be driven blind."""


class MissingStreamError(DataError):
    """A stream that the model names is absent from the log, or empty."""


class FileFormatError(DataError):
    """A file that cannot be read as what it claims to be."""


class ModelError(FactorlabError):
    """The declaration of the model is at fault."""


class NotPositiveDefiniteError(ModelError):
    """A covariance that is not symmetric positive (semi-)definite."""


class NonlinearModelError(ModelError):
    """An estimator was given a model that it cannot take."""


class JacobianMismatchError(ModelError):
    """A declared Jacobian disagrees with central differences of the function it belongs to."""


class SolverError(FactorlabError):
    """The solve is at fault."""


class UnderConstrainedError(SolverError):
    """The data leave some variable free."""


class NotConvergedError(SolverError):
    """The iteration stopped before it settled."""


class ToolMissingError(FactorlabError):
    """A compiler or an emulator that the work needs is not installed, or could not do its work."""
