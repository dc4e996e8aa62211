"""The study casting."""
