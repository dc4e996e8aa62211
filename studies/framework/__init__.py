"""Framework of the studies: sweeps, quantities, findings, figures, provenance, claims."""
