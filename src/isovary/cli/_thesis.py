"""``isovary thesis``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..errors import ArgumentError
from ..io._atomic import check_output, write_folder
from ._app import app, progress, say


@app.command(name="thesis")
def thesis_figures(
    *figures: str,
    out: Annotated[Path, Parameter(name=["--out", "-o"])] = Path("isovary-thesis"),
    small: bool = False,
) -> None:
    """Check the thesis: list its experiments, or run some and draw their figures.

    Parameters
    ----------
    figures
        Numbers of figures, such as 4.11, or all. Without any, a list is printed.
    out
        Folder for the figures and gallery.md; an earlier result in it is replaced.
    small
        Coarse meshes and few eigenpairs: seconds instead of minutes.
    """
    from ..thesis import experiment, experiments
    from ..thesis._gallery import make_gallery

    if not figures:
        for found in experiments():
            say(f"{', '.join((found.number, *found.also)):<24} {found.title}")
        return
    if "all" in figures and len(figures) > 1:
        raise ArgumentError("A02", f"figures: expected all alone, got {' '.join(figures)}")
    chosen = experiments() if figures == ("all",) else [experiment(number) for number in figures]
    check_output(out)
    with progress() as tell, write_folder(out) as folder:
        make_gallery(list(dict.fromkeys(chosen)), folder, small=small, tell=tell)
    say((out / "gallery.md").read_text("utf-8"))
    say(f"open            {out}")
