"""Run every benchmark and put the results into docs/accuracy.md and docs/mesh_noise.png."""

from __future__ import annotations

import os
import platform
from datetime import date
from pathlib import Path

import mesh_noise
import sphere
import walk

import isovary as iv

DOCS = Path(__file__).parents[1] / "docs"


def main() -> None:
    sections = [
        "# Accuracy and time",
        f"Measured with isovary {iv.__version__} on {date.today()}, Python "
        f"{platform.python_version()}, {platform.machine()}, {os.cpu_count()} cores. "
        "`make bench` measures again and rewrites this page.",
        sphere.report(),
        "![Error of the change, carried and with independent meshes](mesh_noise.png)",
        mesh_noise.report(DOCS / "mesh_noise.png"),
        walk.report(),
    ]
    text = "\n\n".join(section.rstrip() for section in sections) + "\n"
    (DOCS / "accuracy.md").write_text(text, encoding="utf-8")
    print(text)


if __name__ == "__main__":
    main()
