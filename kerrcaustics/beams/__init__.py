"""Which star direction does a camera-sky direction see, and how magnified? Two engines, one answer."""
