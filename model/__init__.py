"""The robot: parameters, energies, laws, drives, sensors and exact responses; physics only."""
