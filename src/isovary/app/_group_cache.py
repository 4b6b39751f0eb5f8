"""Groups of a result for each count: what one session found, all others read."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..records import Clusters
from ._groupings import COUNTS, counts_around, groupings
from ._saved_result import read_result


def kept_groups(cache: Path, name: str) -> dict[int, Clusters]:
    """The groups found so far of the result of this name, by count."""
    found = {}
    for path in cache.glob(f"{name}-*.npz"):
        with np.load(path) as file:
            clusters = Clusters(file["labels"], file["centers"], file.get("memberships"))
        found[int(path.stem.rpartition("-")[2])] = clusters
    return found


def name_of(folder: Path) -> str:
    """The name of a result, from its content and the choices that made its groups."""
    choices = json.loads((folder / "summary.json").read_text(encoding="utf-8"))["choices"]
    made = [choices.get(key) for key in ("clustering", "seed", "area_weighted")]
    digest = hashlib.sha256((folder / "change.vtu").read_bytes())
    digest.update(json.dumps(made).encode())
    return digest.hexdigest()


def find_groups(folder: Path, cache: Path, progress: Callable[[str, float], None]) -> None:
    """Find the groups for every count, those near the saved one first, and keep each.

    Parameters
    ----------
    folder : Path
        That ``isovary compare`` wrote.
    cache : Path
        Folder of this server's.
    progress : callable
        Called with the count, in words, and the part done, after each.
    """
    name, result = name_of(folder), read_result(folder)
    kept = kept_groups(cache, name)
    missing = [count for count in counts_around(max(2, result.count), COUNTS) if count not in kept]
    for done, (count, clusters) in enumerate(groupings(result, missing), 1):
        handle, temporary = tempfile.mkstemp(dir=cache)
        with os.fdopen(handle, "wb") as file:
            arrays: dict[str, np.ndarray] = {"labels": clusters.labels, "centers": clusters.centers}
            if clusters.memberships is not None:
                arrays["memberships"] = clusters.memberships
            np.savez(file, allow_pickle=False, **arrays)
        Path(temporary).replace(cache / f"{name}-{count}.npz")
        progress(f"{count} groups", done / len(missing))
