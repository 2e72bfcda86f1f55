"""Two palettes for every picture, film and page: one of image indices, warm, and one of caustic orders, cool.

No colour is in both, so that images and curves share a picture. Readers who see no red, or no green, keep warm and cool
apart, and within a palette the lightness: the first four of both differ by 15 or more in CIEDE2000 for them (on black,
11). Thin lines of all have a contrast of 2 or more with their ground.
"""

ORDER = ("#332288", "#44AA99", "#B15DC8", "#01665E", "#56B4E9")
"""Critical curves and caustics of order 1, 2, 3, ... on white."""

INDEX = ("#DC3C2C", "#E69F00", "#5C2E00", "#222222")
"""Images, tracks and rays of Morse index 0, 1, 2, ... on white; crossings of the plane from 1 likewise."""

ORDER_ON_BLACK = ("#7F6BFF", "#4FD0B8", "#E2A0F2", "#1F8A7D", "#8FD3FF")
"""The same orders on black, over stars and in the dark page."""

INDEX_ON_BLACK = ("#FF6B5E", "#FFD447", "#A8622A", "#FFFFFF")
"""The same indices on black: red and yellow as the primary and secondary images of JTFT."""

STAR_COLOUR, STAR_ON_BLACK = "#D81B8C", "#FF6EC7"
"""A star on the surface of the sources, on white and on black."""

THEMES = {
    "light": {"order": ORDER, "index": INDEX, "star": STAR_COLOUR},
    "dark": {"order": ORDER_ON_BLACK, "index": INDEX_ON_BLACK, "star": STAR_ON_BLACK},
}
"""The palettes by the theme of a page."""
