"""The thesis, experiment by experiment: what it claims, what is measured, and the verdict.

An experiment is a file ``_fig_4_3.py`` with ``EXPERIMENT``, beside its settings ``fig_4_3.toml``.
A new one is found by its name.
"""

from ._records import Experiment, Finding, Outcome, Settings, Verdict
from ._register import experiment, experiments, settings_of

__all__ = [
    "Experiment",
    "Finding",
    "Outcome",
    "Settings",
    "Verdict",
    "experiment",
    "experiments",
    "settings_of",
]
