"""The runs of `make demo`, and what is said of them."""
