"""The study gravish."""
