"""The thesis's figures and numbers, one question a file, and its slips, all set beside ours."""
