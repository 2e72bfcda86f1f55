"""Images of sources that move: level curves of the lens map, their events, light curves."""
