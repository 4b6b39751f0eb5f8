"""``isovary export``."""

from __future__ import annotations

from pathlib import Path

from ..io._export import export_csv
from ._app import app, say


@app.command(name="export")
def export_result(
    result: Path,
    /,
    *,
    csv: Path | None = None,
    full: bool = False,
) -> None:
    """Write a table of all nodes of a result, one row each.

    Parameters
    ----------
    result
        Folder that compare wrote.
    csv
        File for the table. Default: nodes.csv here.
    full
        Also the signatures and the change at every time.
    """
    path = csv or Path("nodes.csv")
    count = export_csv(result, path, full=full)
    say(f"{path}: {count} nodes")
