"""What a run will do and cost, and why."""
