"""A result made ready for the page: what is the same for every position of its sliders."""

from __future__ import annotations

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ..geometry import Floats, Ints, edge_length, node_areas
from ..records import Clusters
from ..view._camera import choose_camera
from ..view._tessellate import at_pieces, outside, tessellate
from ._group_cache import name_of
from ._groupings import saved_groups
from ._painting import Drawn, drawn
from ._saved_result import SavedResult, read_result

_NEAR = 2.0  # edges between a place and the partner that it belongs to


@dataclass(frozen=True, eq=False)
class OpenedResult:
    """A saved result, and what is drawn of it.

    Parameters
    ----------
    saved : SavedResult
    name : str
        Under which its groups are kept.
    base, perturbed : Drawn
    norm : array (n,)
        Mean size of the change over all scales; NaN without a partner.
    areas : array (n,)
        Of the nodes; length^2.
    groups : Clusters
        Those in the file.
    towards, up : array (3,)
        The direction to the viewer, and up, that the pictures are drawn with.
    places, partners : cKDTree
        Of the base's nodes, and of the partners of those that have one, ``partnered``.
    near : float
        How far from a partner a place may be that belongs to it; length.
    """

    saved: SavedResult
    name: str
    base: Drawn
    perturbed: Drawn
    norm: Floats
    areas: Floats
    groups: Clusters
    towards: Floats
    up: Floats
    places: cKDTree
    partnered: Ints
    partners: cKDTree
    near: float

    def node_at(self, view: str, place: Floats) -> int | None:
        """The base's node nearest to a place in a view, None where there is no partner near."""
        if view != "perturbed":
            return int(self.places.query(place)[1])
        away, found = self.partners.query(place)
        return int(self.partnered[found]) if away < self.near else None


def open_folder(folder: Path) -> OpenedResult:
    """Read a folder that ``isovary compare`` wrote, and prepare all of it.

    Raises
    ------
    IsovaryError
        As `read_result`.

    Notes
    -----
    Cost: 2 s for 10 000 nodes, most of it reading; to be run in a thread.
    """
    result = read_result(folder)
    base, norm = result.base, result.change_norm
    towards, up = _best_view(result, norm)
    partnered = np.flatnonzero(np.isfinite(result.partners).all(axis=1))
    return OpenedResult(
        saved=result,
        name=name_of(folder),
        base=drawn(base),
        perturbed=drawn(result.perturbed),
        norm=norm,
        areas=node_areas(base.points, base.triangles),
        groups=saved_groups(result),
        towards=towards,
        up=up,
        places=cKDTree(base.points),
        partnered=partnered,
        partners=cKDTree(result.partners[partnered]),
        near=_NEAR * edge_length(base.points, base.triangles),
    )


def _best_view(result: SavedResult, norm: Floats) -> tuple[Floats, Floats]:
    pieces, shown = tessellate(result.base, 1), np.where(result.significant, norm, 0.0)
    node, weight = int(shown.argmax()), np.nan_to_num(at_pieces(result.base, 1, shown))
    side = outside(result.base)
    mark = (result.base.points[node], side * result.base.normals[node]) if shown.any() else None
    camera = choose_camera(pieces.middles, pieces.facing, weight * pieces.areas, mark)
    return camera.axes[2], camera.axes[1]


def offer(folder: Path, out: Path) -> list[dict[str, str]]:
    """Make the plain files of a result downloads; returns their names and sizes.

    Links are left out: who unpacked a result did not mean to hand on what they lead to.
    """
    offered = []
    for path in sorted(folder.iterdir()):
        if path.is_file() and not path.is_symlink() and not path.name.startswith("."):
            (out / path.name).unlink(missing_ok=True)
            try:
                os.link(path, out / path.name)
            except OSError:  # another file system
                shutil.copy2(path, out / path.name)
            offered.append({"name": path.name, "size": size(path)})
    return offered


def size(path: Path) -> str:
    """A file's size in words."""
    count = float(path.stat().st_size)
    for unit in ("B", "kB", "MB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.3g} GB"
