"""Speed, measured: each figure beside what it replaces, both timed in the same run."""
