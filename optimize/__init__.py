"""From a robot to a swing or a design."""
