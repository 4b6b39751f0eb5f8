"""The exception tree of isovary.

::

    IsovaryError                 everything isovary raises on purpose
    |-- ArgumentError            A: an argument of wrong type, shape or range (also ValueError)
    |-- FileError                F: a file cannot be read, or does not hold what it claims
    |-- FieldError               I: a scalar field or its isosurface is unusable
    |-- MeshError                M: a mesh is broken, or a mesher gave up
    |-- SpectrumError            S: an eigenproblem was not solved to its promises
    |-- CorrespondenceError      C: two surfaces cannot be matched
    |-- ClusterError             K: a grouping is impossible
    `-- RunError                 W: results cannot be written, or a run cannot go on

Every error carries a stable ``code`` such as ``"I02"`` and a text that reads
``name: expected X, got Y``, followed by what to do.
"""

from __future__ import annotations


class IsovaryError(Exception):
    """Base class of every error that isovary raises on purpose.

    Parameters
    ----------
    code : str
        Stable code of the fault, for example ``"I02"``.
    message : str
        What was expected, what was found, and what to do.

    Examples
    --------
    >>> error = FieldError("I02", "isovalue: expected a value in [0, 1], got 2")
    >>> error.code, str(error)
    ('I02', 'isovalue: expected a value in [0, 1], got 2 [I02]')
    """

    def __init__(self, code: str, message: str) -> None:
        super().__init__(code, message)
        self.code = code
        self.message = message

    def __str__(self) -> str:
        return f"{self.message} [{self.code}]"


class ArgumentError(IsovaryError, ValueError):
    """An argument has the wrong type, shape or range."""


class FileError(IsovaryError):
    """A file cannot be read, or does not hold what it claims."""


class FieldError(IsovaryError):
    """A scalar field, or its isosurface, is unusable."""


class MeshError(IsovaryError):
    """A mesh is broken, or a mesher gave up."""


class SpectrumError(IsovaryError):
    """An eigenproblem was not solved to its promises."""


class CorrespondenceError(IsovaryError):
    """Two surfaces cannot be matched."""


class ClusterError(IsovaryError):
    """A grouping is impossible."""


class RunError(IsovaryError):
    """Results cannot be written, or a run cannot go on."""
