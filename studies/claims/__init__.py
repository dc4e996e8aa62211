"""The claims of the paper, one by one, with the verdict of our studies: `results/CLAIMS.md`."""
