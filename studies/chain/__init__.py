"""The study chain."""
