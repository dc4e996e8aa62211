"""Compare cost and overlap of our engines and others, starting from equal poses."""
