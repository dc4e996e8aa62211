"""The paper's own engine, Project Chrono, beside links: the same piles, motors' rules and measures."""
