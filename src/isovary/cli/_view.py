"""``isovary view``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from ..errors import ArgumentError, FileError, RunError
from ._app import Whole, app, say


@app.command(name="view")
def view_result(
    result: Path | None = None,
    /,
    *,
    port: Whole = 8080,
    browser: bool = True,
    root: Annotated[Sequence[Path], Parameter(consume_multiple=True)] = (),
    host: str = "127.0.0.1",
    hosts: Annotated[Sequence[str], Parameter(consume_multiple=True)] = (),
    sessions: Whole = 20,
    jobs: Whole = 1,
) -> None:
    """Open the page in the browser: explore a result, compare fields, make dimples.

    It answers this computer only, and only whoever knows the secret in its address.

    Parameters
    ----------
    result
        Folder that compare wrote. Without one the page begins with the choice of two fields.
    port
        0: any that is free.
    browser
        Open the browser.
    root
        Folders whose field files the page offers. Default: this one.
    host
        Address to listen at. With another one than 127.0.0.1, others reach it, too.
    hosts
        Names by which browsers call it, if not by its address, as behind a proxy.
    sessions
        At most so many at once.
    jobs
        At most so many comparisons at once; further ones wait.
    """
    try:
        from ..app._gateway import run
        from ..app._locks import new_token
        from ..app._settings import GatewaySettings
        from ..app._static import page_folders

        page_folders()  # imports what the page is made of
    except ModuleNotFoundError as error:
        raise RunError(
            "W10",
            f"isovary view: expected the package {error.name}, got none; "
            "install it with: pip install 'isovary[app]'",
        ) from error
    _check(result, port, sessions=sessions, jobs=jobs)
    settings = GatewaySettings(
        token=new_token(),
        host=host,
        port=port,
        hosts=tuple(hosts),
        sessions=sessions,
        jobs=jobs,
        roots=tuple(folder.resolve() for folder in root or (Path.cwd(),)),
        result=None if result is None else result.resolve(),
    )
    run(settings, browser, say)


def _check(result: Path | None, port: int, **counts: int) -> None:
    """FileError F01 or ArgumentError A02 before anything is started."""
    if result is not None and not result.is_dir():
        raise FileError(
            "F01", f"{result}: expected a folder that isovary compare wrote, got none; see --out"
        )
    if not 0 <= port <= 65535:
        raise ArgumentError("A02", f"port: expected 0 to 65535, got {port}")
    for name, count in counts.items():
        if count < 1:
            raise ArgumentError("A02", f"{name}: expected 1 or more, got {count}")
