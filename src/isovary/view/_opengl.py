"""Can VTK draw here? Asked of a child process, because the answer may be a segmentation fault."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from functools import cache

PACKAGES = "libegl1 libgl1-mesa-dri"
"""Debian packages that make VTK draw without a screen."""

_DRAW_A_LITTLE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
window.AddRenderer(vtkRenderer())
window.Render()
"""
_COMMAND = (sys.executable, "-c", _DRAW_A_LITTLE)
_TIMEOUT = 60.0


def can_draw() -> bool:
    """Whether VTK can draw here; otherwise pictures are drawn by matplotlib alone.

    The first call starts a child process (0.3 s), later ones remember the
    answer. ``ISOVARY_NO_OPENGL=1`` in the environment answers no.

    Returns
    -------
    bool
    """
    return opengl_problem() is None


def opengl_problem() -> str | None:
    """Why VTK cannot draw here and which packages help; None if it can.

    Returns
    -------
    str or None
    """
    if os.environ.get("ISOVARY_NO_OPENGL", "") not in ("", "0"):
        return "OpenGL is switched off by ISOVARY_NO_OPENGL; drawn by matplotlib instead."
    return probe(_COMMAND)


@cache
def probe(command: Sequence[str], timeout: float = _TIMEOUT) -> str | None:
    """Run a command that draws; None if it ends well, else a text that tells what to do.

    Parameters
    ----------
    command : tuple of str
        Program and arguments.
    timeout : float
        Seconds after which the child is ended.

    Returns
    -------
    str or None
    """
    try:
        child = subprocess.run(command, capture_output=True, timeout=timeout, check=False)
    except subprocess.TimeoutExpired:
        outcome = f"did not end within {timeout:g} s"
    except OSError as error:
        outcome = f"could not be started: {error}"
    else:
        if child.returncode == 0:
            return None
        ended = "was ended by signal" if child.returncode < 0 else "ended with code"
        outcome = f"{ended} {abs(child.returncode)}"
    return (
        f"OpenGL is missing (a test drawing {outcome}): drawn by matplotlib instead. "
        f"On Debian or Ubuntu install {PACKAGES}."
    )
