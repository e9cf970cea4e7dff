"""Joint friction: points from sections, models, fits and their honesty."""
