"""The explorer: a page on which the star is dragged, and pairs of images appear; in the browser and in notebooks."""
