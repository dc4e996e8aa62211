"""The study procedures."""
