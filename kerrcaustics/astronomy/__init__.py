"""At the edge: units of astronomers, and files and maps that their programs know."""
