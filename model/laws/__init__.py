"""The library of laws: each file holds one `LAW`; a new file is a new cause, no list to edit."""
