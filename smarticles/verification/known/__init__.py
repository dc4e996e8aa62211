"""Small simulations whose answer is on paper."""
