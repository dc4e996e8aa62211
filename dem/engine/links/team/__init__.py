"""The same steps on several threads: kernels that threads run together, and what starts them."""
