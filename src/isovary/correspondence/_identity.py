"""Each node matched to itself: two surfaces with one mesh."""

from __future__ import annotations

import numpy as np

from ..errors import CorrespondenceError
from ..geometry import own_places
from ..records import Correspondence, Surface


def identity(base: Surface, perturbed: Surface) -> Correspondence:
    """Each node of the base matched to the same node of a surface with the same triangles.

    Parameters
    ----------
    base, perturbed : Surface
        Of equal connectivity, as a carried or a deformed mesh has.

    Returns
    -------
    Correspondence
        ``distance`` is the displacement along the base normal.

    Raises
    ------
    CorrespondenceError
        C09 if the triangles differ.

    Examples
    --------
    >>> triangle = Surface([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    >>> lifted = Surface(triangle.points + [0, 0, 0.5], triangle.triangles)
    >>> identity(triangle, lifted).distance.tolist()
    [0.5, 0.5, 0.5]
    """
    if not np.array_equal(base.triangles, perturbed.triangles):
        raise CorrespondenceError(
            "C09",
            f"triangles: expected the same {len(base.triangles)} in both surfaces, got "
            f"{len(perturbed.triangles)} or other ones; use normal_rays or closest_point",
        )
    triangle, barycentric = own_places(base.triangles)
    distance = np.einsum("nd,nd->n", perturbed.points - base.points, base.normals)
    hits = np.ones(len(triangle), dtype=np.int64)
    return Correspondence(triangle, barycentric, distance, hits)
