"""Images of sources: certified, counted, differentiated."""
