"""Columns that tables over runs and seeds have in common."""

from __future__ import annotations

ASPECT, SEED, SEEDS = "aspect ratio [-]", "seed", "seeds [-]"
