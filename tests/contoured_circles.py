"""Images of a great circle by contours on a grid: the slow, obvious twin of kerrcaustics.tracks.circles.

On a sheet of the camera sky the height of a direction's image above the circle is tabulated on a fine grid; its zero
contours are the images, in the coordinates of the sheet, good to the grid's own step.
"""

import numpy as np
from skimage.measure import find_contours

from kerrcaustics.beams.trace import rays_of_directions
from kerrcaustics.images.sheets import sheets_of
from kerrcaustics.lens_map import sky_lines
from kerrcaustics.lens_map.search_sky import as_seen
from kerrcaustics.spacetime.sphere import from_angles

# A turn that is no line of symmetry, where the grid's seam lies; and the part of a sheet next to its edges left out.
SEAM, MARGIN = 0.7, 1e-6


def contours(camera, normal, index, lines, places):
    """Contours on the sheet of one index, each as directions N (n, 3), cut at the seam of the grid."""
    sheets = sheets_of(camera, index)
    sheet = sheets.sheets[index]
    turn = SEAM + np.linspace(0, 2 * np.pi, lines)
    # Dense toward both edges, where images crowd.
    part = MARGIN + (1 - 2 * MARGIN) * (1 - np.cos(np.linspace(0, np.pi, places))) / 2

    def sky(at_turn, at_part):
        return sheets.sky(sky_lines.line_of_sight(sheets.camera, at_turn, sheet.depth(at_turn, at_part)))

    grid = np.meshgrid(turn, part, indexing="ij")
    height = rays_of_directions(sheets.camera, sky(*grid)).direction @ from_angles(*normal)
    found = []
    for line in find_contours(height, 0.0):
        at = (np.interp(line[:, i], np.arange(len(axis)), axis) for i, axis in enumerate((turn, part)))
        found.append(as_seen(sky(*at), sheets.frame, camera.frame()))
    return found
