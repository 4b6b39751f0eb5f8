"""Puts measured tables between the markers of a page of the documentation."""

from __future__ import annotations

import os
import platform
from datetime import date
from pathlib import Path

import isovary as iv


def write_page(page: Path, script: str, tables: dict[str, str]) -> None:
    """Put each table between its markers; over the first stands on what it was measured."""
    text = page.read_text(encoding="utf-8")
    heading = (
        f"Measured with isovary {iv.__version__} on {date.today()}, Python "
        f"{platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores; "
        f"`python benchmarks/{script}` measures again.\n\n"
    )
    for name, table in tables.items():
        begin, end = f"<!-- measured {name}: begin -->", f"<!-- measured {name}: end -->"
        head, tail = text.split(begin)[0], text.split(end)[1]
        said = heading if name == next(iter(tables)) else ""
        text = f"{head}{begin}\n{said}{table}{end}{tail}"
    page.write_text(text, encoding="utf-8")
