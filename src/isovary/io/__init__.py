"""The door for files: scalar fields in, results out.

Every reader keeps spacing and origin, checks the file against its own header
before it allocates, and ends in a :class:`~isovary.errors.FileError` rather
than in a wrong field.
"""

from ._fields import read_field

__all__ = ["read_field"]
