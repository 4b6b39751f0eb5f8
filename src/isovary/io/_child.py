"""Native readers run in a child process: a crash there ends in an error here."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

from ..errors import FileError


def run_child(script: Path, path: Path, *arguments: str) -> dict[str, Any]:
    """Run ``python SCRIPT PATH ARGUMENTS`` and return the JSON it prints; FileError F06."""
    command = [sys.executable, "-P", str(script), str(path.absolute()), *arguments]
    patience = 60 + path.stat().st_size / 1e6  # seconds; VTK reads 100 MB/s and more
    try:
        child = subprocess.run(
            command, stdin=subprocess.DEVNULL, capture_output=True, timeout=patience, check=False
        )
    except subprocess.TimeoutExpired:
        raise FileError(
            "F06",
            f"{path}: expected VTK to read it in {patience:.0f} s, got no end; it is damaged",
        ) from None
    if child.returncode == 0:
        report: dict[str, Any] = json.loads(child.stdout)
        return report
    said = child.stderr.decode(errors="replace").strip().splitlines() or ["no message"]
    how = f"a crash (signal {-child.returncode})" if child.returncode < 0 else "a failure"
    raise FileError(
        "F06", f"{path}: expected VTK to read it, got {how}: {said[-1][:300]}; the file is damaged"
    )
