"""Measures of frames and runs: all public names of `postprocess`."""

from postprocess import *  # noqa: F403  (all of them)
from postprocess import __all__ as __all__  # noqa: PLC0414  (exported, too)
