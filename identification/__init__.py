"""From measured data to a robot with error bars, and to the names of what its model lacks."""
