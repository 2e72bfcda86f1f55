"""The lens map: from the sky that is searched to a surface of sources."""
