"""Films of any pictures: frames drawn by whom it may be, kept until the film is complete, and joined."""
