"""Identification beyond friction: drive gains, inertials, tool, force sensor, delays; from any motion."""
