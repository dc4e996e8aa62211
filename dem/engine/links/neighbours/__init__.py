"""Search for links that are near each other, and lists of them."""
