"""The study melting."""
