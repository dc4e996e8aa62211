"""Claims of the paper with verdicts from the findings of the studies: `results/CLAIMS.md`."""
