"""Known answers: small simulations through the engine that users run, whose answer is on paper.

A case compares quantities with theory; a ladder compares a trajectory at several time steps and so tells the order of
the scheme. `smarticles verify` runs them all. Nothing here draws: results are tables, read by
`smarticles.verification.report` in another process.
"""
