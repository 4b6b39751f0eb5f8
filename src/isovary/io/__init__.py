"""The door for files: scalar fields and surfaces in, results out.

Every reader keeps lengths and positions, checks the file against its own header
before it allocates, and ends in a :class:`~isovary.errors.FileError` rather
than in a wrong field or mesh.
"""

from ._fields import read_field
from ._surfaces import read_surface

__all__ = ["read_field", "read_surface"]
