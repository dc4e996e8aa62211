"""Cases whose answer is on paper."""
