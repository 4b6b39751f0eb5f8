"""Sphinx configuration. The API page is written from ``isovary.__all__``, so it cannot go stale."""

from __future__ import annotations

import importlib.metadata
import inspect
from typing import TYPE_CHECKING

import isovary

if TYPE_CHECKING:
    from sphinx.application import Sphinx

project = "isovary"
author = "the isovary developers"
copyright = "2026, the isovary developers"
release = version = importlib.metadata.version("isovary")

extensions = ["myst_parser", "numpydoc", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # the docstrings state types with shapes and units
autodoc_member_order = "bysource"
numpydoc_show_class_members = False

html_theme = "furo"
html_title = f"isovary {version}"

# Where a name is defined -> heading, in the order of the method. Others follow at the end.
STEPS = {
    "comparison": "Comparison",
    "scalar_field": "Fields",
    "records": "Records",
    "io": "Reading fields and surfaces",
    "shapes": "Known shapes",
    "potentials": "Potentials",
    "deform": "Dimples",
    "meshing": "Meshing",
    "laplacian": "Laplacians",
    "rims": "Rims",
    "spectrum": "Eigenpairs",
    "signature": "Signatures",
    "alignment": "Alignment",
    "carrying": "Carrying",
    "correspondence": "Correspondence",
    "difference": "Difference",
    "noise": "Noise floor",
    "sweep": "Sweeps",
    "clustering": "Groups",
    "embedding": "Embedding",
    "color": "Colour",
    "geometry": "Geometry",
    "errors": "Errors",
}


def api_page() -> str:
    """Return a section for each step, with the public names that are defined there."""
    sections: dict[str, list[str]] = {step: [] for step in STEPS}
    for name in getattr(isovary, "__all__", []):
        value = getattr(isovary, name)
        module = getattr(value, "__module__", None) or ""
        if not module.startswith("isovary."):
            continue  # __version__ and the like
        if inspect.isclass(value):
            entry = f".. autoclass:: isovary.{name}\n   :members:\n   :show-inheritance:\n"
        else:
            entry = f".. autofunction:: isovary.{name}\n"
        sections.setdefault(module.split(".")[1], []).append(entry)
    return "".join(
        f"\n## {STEPS.get(step, step)}\n\n```{{eval-rst}}\n{chr(10).join(entries)}```\n"
        for step, entries in sections.items()
        if entries
    )


def extend_api_page(app: Sphinx, docname: str, source: list[str]) -> None:
    """Append the generated sections to api.md."""
    if docname == "api":
        source[0] += api_page()


def setup(app: Sphinx) -> None:
    """Register what this configuration adds to Sphinx."""
    app.connect("source-read", extend_api_page)
