"""Which links are near each other."""
