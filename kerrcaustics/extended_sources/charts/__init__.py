"""Images of a disc by contours on charts."""
