"""What the page is told when it starts."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class SessionSettings:
    """What one session knows.

    Parameters
    ----------
    folder : path
        The session's own folder: ``in`` for uploads, ``out`` for downloads. Emptied and removed
        by the gateway when the session ends.
    cache : path
        Folder that all sessions share, for what one found and others need.
    roots : tuple of path
        Folders below which files may be opened by name.
    result : path, optional
        Folder that ``isovary compare`` wrote, opened first.
    """

    folder: Path
    cache: Path
    roots: tuple[Path, ...] = ()
    result: Path | None = None


@dataclass(frozen=True)
class GatewaySettings:
    """What the gateway knows.

    Parameters
    ----------
    host, port : str, int
        Where to listen; port 0 is any free one.
    token : str
        The secret that opens a session, 256 random bits.
    hosts : tuple of str
        Further names by which the page may be called.
    sessions, jobs : int
        At most so many sessions, and long runs at once; further runs wait in a queue.
    linger : float
        Seconds that a session without a browser is kept, so that a lost connection resumes.
    upload : int
        Bytes of the largest file taken.
    roots, result
        As in `SessionSettings`.
    """

    token: str
    host: str = "127.0.0.1"
    port: int = 0
    hosts: tuple[str, ...] = ()
    sessions: int = 20
    jobs: int = 1
    linger: float = 60.0
    upload: int = 1024**3
    roots: tuple[Path, ...] = ()
    result: Path | None = None
