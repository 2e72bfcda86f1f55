"""The light of small balls on orbits, next to pair events too, where a point would be infinitely bright.

A ball of radius s and luminosity 1 that shines alike to all sides, and evenly, has the flux

    F = 1 / (4 pi^2 s^2) * integral of g^4 over its image on the sky, where |xi(N)| < s:

xi is the place at which a ray that arrives at the same time passes the source, across the ray, in the source's own
frame. With k.d = 0 for all d between events that are seen at once, |xi|^2 = G_ij dx^i dx^j with
G_ij = g_ij + g_ti p_j + g_tj p_i + g_tt p_i p_j, p the momentum of the light: G is free of the source's motion.

Images whose light hardly changes over the ball are measured along their limb (smooth_light.py). The others are cut into
slices along their spines, where xi_t = 0, t being the direction along the caustic: xi_n has an extreme at the fold, so
that both images of a pair lie on one spine, along which nothing is singular. Slices are planes N.e = p about a
direction e of the spine: the solid angle between two is dp dphi, phi being the azimuth about e.
"""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.light_curves.arrivals import Arrivals, Source, along_sky, solutions
from kerrcaustics.light_curves.ball_distance import separation
from kerrcaustics.light_curves.ball_passes import Passes, RayAims
from kerrcaustics.light_curves.curve_following import replaced
from kerrcaustics.light_curves.seen_images import size_and_ratio
from kerrcaustics.shapes import Bool, Float
from kerrcaustics.spacetime.cubic_curves import Cubics
from kerrcaustics.spacetime.kerr import horizon_product
from kerrcaustics.spacetime.sphere import lengths, tangent_basis

Array = np.ndarray

# Newton steps to a place of the ball.
_NEWTON = 8
# Distance from the place at which they have converged, in radii of the ball.
_CLOSE = 1e-7
# Curvature of a path over the ball's radius above which the ray is evaluated at closest approach.
_BENT = 1e-3
# Part of the radius within which corrections of places fade.
_MIDDLE = 1e-3
# Steps along a path toward its closest approach.
_STEPS = 2
# Most steps of rays that are then still too far from it.
_MOST_STEPS = 6
# The first step along a spine, in radii of the ball by the steeper slope.
_FIRST = 0.3
# Factor by which each step may grow.
_GROWTH = 1.8
# The longest step of xi_n, as a part of the distance from the limb.
_FAR = 0.4
# The least such limit, in radii of the ball.
_LEAST_FAR = 0.04
# The least cosine of a turn between two steps.
_STRAIGHT = 0.9
# The largest number of steps.
_MOST = 150
# The shortest step, as a part of the first.
_SHORTEST = 1e-4
# Distance from a tip at which it is reached, as a part of the first step.
_AT_TIP = 1e-5
# Nodes and weights of slices between two steps.
_NODES, _WEIGHTS = (values / 2 for values in np.polynomial.legendre.leggauss(4))
# The least cosine between a spine and the direction of its slices.
_LEAST_COSINE = 0.4


def _form(rays: Arrivals) -> Float[Array, "n 3 3"]:
    """The metric across the rays at the source, for dr, dtheta, sin theta dphi."""
    a, r, z = rays.source.spin, rays.places.radius, rays.places.vector[:, 2]
    square, delta, sigma = 1 - z * z, horizon_product(a, r), r * r + (a * z) ** 2
    p = np.stack(rays.momentum, axis=-1)
    form = np.zeros((len(r), 3, 3))
    form[:, 0, 0], form[:, 1, 1] = sigma / delta, sigma
    form[:, 2, 2] = ((r * r + a * a) ** 2 - a * a * delta * square) / sigma
    drag = np.zeros_like(p)
    drag[:, 2] = -2 * a * r * np.sqrt(square) / sigma
    mixed = drag[:, :, None] * p[:, None, :]
    slow = (2 * r / sigma - 1)[:, None, None] * p[:, :, None] * p[:, None, :]
    return form + mixed + mixed.transpose(0, 2, 1) + slow


def _product(
    first: Float[Array, "n 3"], form: Float[Array, "n 3 3"], second: Float[Array, "n 3"]
) -> Float[Array, " n"]:
    return np.einsum("ni,nij,nj->n", first, form, second)


@dataclass(frozen=True)
class MovingBall:
    """A ball on its orbit. size: its radius; highest: Morse index up to which its light is taken."""

    source: Source
    size: float
    highest: int

    def passes(self, aims: RayAims) -> Passes:
        """The rays of aims as they are."""
        rays = self._closest_rays(aims)
        form = _form(rays)
        size, ratio = size_and_ratio(rays)
        r = rays.places.radius
        with np.errstate(invalid="ignore", divide="ignore"):
            apart = separation(rays)
            first = aims.axes[:, 0] / np.sqrt(_product(aims.axes[:, 0], form, aims.axes[:, 0]))[:, None]
            second = aims.axes[:, 1] - _product(aims.axes[:, 1], form, first)[:, None] * first
            second = second / np.sqrt(_product(second, form, second))[:, None]
            across = np.stack([first, second], axis=1) @ form
            return Passes(
                sky=rays.sky,
                time=rays.time,
                time_deficit=(aims.arrival - rays.arrival - apart.delay) / apart.rate,
                place=self._lengthened((across @ rays.offset[:, :, None])[:, :, 0], apart.distance),
                by_sky=across @ rays.columns,
                by_time=-(across @ rays.velocity[:, :, None])[:, :, 0],
                light=(ratio * rays.rate / apart.rate) ** 4 * size**2,
                relative_error=(self.size / r) ** 2 + rays.offset_along_ray**2 + 2 * rays.beams.error * r / self.size,
                index_kept=np.asarray(rays.beams.index) <= self.highest,
            )

    def _lengthened(self, place: Float[Array, "n 2"], distance: Float[Array, " n"]) -> Float[Array, "n 2"]:
        """Places across the rays, which are right in the first order, with the distance itself."""
        # In the middle both lengths are rounding.
        least = (_MIDDLE * self.size) ** 2
        return place * np.sqrt((distance**2 + least) / ((place**2).sum(axis=1) + least))[:, None]

    def _closest_rays(self, aims: RayAims) -> Arrivals:
        """Rays at their closest approach to the ball, which is far from it for rays that graze the source's sphere."""
        rays = self.source.arrivals(aims.sky, aims.time, aims.second)
        near, radius = rays.offset_along_ray, rays.closest_radius
        radius, second = radius * rays.places.radius, aims.second.copy()
        with np.errstate(invalid="ignore"):
            far = np.flatnonzero(near**2 * rays.places.radius > _BENT * self.size)
        if not len(far):
            return rays
        best, aim = near[far], radius[far]
        radius = rays.places.radius.copy()
        enough = np.sqrt(_BENT * self.size / radius[far])
        for leaf in (aims.second[far], ~aims.second[far]):
            start = aim
            for step in range(_MOST_STEPS):
                # As few steps as possible: derivatives diverge at the turning point of a ray.
                away = (step < _STEPS) | ~(best <= enough)
                if not away.any():
                    break
                trial = self.source.arrivals(aims.sky[far], aims.time[far], leaf, start)
                with np.errstate(invalid="ignore"):
                    better = away & (trial.offset_along_ray < best)
                best = np.where(better, trial.offset_along_ray, best)
                radius[far[better]], second[far[better]] = start[better], leaf[better]
                start = trial.closest_radius * trial.places.radius
        return self.source.arrivals(aims.sky, aims.time, second, radius)

    def rays_through(
        self,
        aims: RayAims,
        aim: Float[Array, "n 2"],
        ahead: Float[Array, "n 3"] | None = None,
        *,
        limb: bool = False,
    ) -> tuple[Passes, Bool[Array, " n"]]:
        """Rays made to pass the ball at places, and True for those that do.

        ahead: if given, the second part of the aim is N.ahead instead of xi_n.
        limb: if True, the first part is |xi| instead of xi_t.
        """
        now, good = self.passes(aims), np.zeros(len(aims), bool)
        for _ in range(_NEWTON):
            matrix, lack, by_time = now.by_sky.copy(), aim - now.place, now.by_time.copy()
            if limb:
                off = lengths(now.place)
                way = now.place / off[:, None]
                matrix[:, 0] = (way[:, None, :] @ now.by_sky)[:, 0]
                lack[:, 0], by_time[:, 0] = aim[:, 0] - off, (way * now.by_time).sum(axis=1)
            if ahead is not None:
                matrix[:, 1] = np.stack([(e * ahead).sum(axis=1) for e in tangent_basis(now.sky)], axis=-1)
                lack[:, 1], by_time[:, 1] = aim[:, 1] - (now.sky * ahead).sum(axis=1), 0.0
            step = solutions(matrix, lack - by_time * now.time_deficit[:, None])
            with np.errstate(invalid="ignore"):
                left = now.steepest * lengths(step) + lengths(now.by_time) * np.abs(now.time_deficit)
                good = np.isfinite(now.light) & (left < _CLOSE * self.size)
                still = good | ~np.isfinite(left)
            if still.all():
                break
            step[still] = 0.0
            now = self.passes(
                aims.with_directions(along_sky(now.sky, step), now.time + np.where(still, 0.0, now.time_deficit))
            )
        return now, good

    def sliced_light(self, starts: RayAims) -> "list[SlicedImage | None]":
        """The parts of the image on the spines next to starts; None where they cannot be followed."""
        here = self.passes(starts)
        # Straight across to the spine.
        here, good = self.rays_through(
            starts,
            np.stack([np.zeros(len(starts)), (here.sky * here.spine).sum(axis=1)], axis=-1),
            here.spine,
        )
        spines = self._spines(starts, here, good)
        return self._slice_light(starts, spines)

    def _spines(self, starts: RayAims, here: Passes, good: Bool[Array, " n"]) -> "list[Passes | None]":
        """The spines from tip to tip; None if lost, without rows if the ball's image does not reach the start."""
        n = len(starts)
        walker = np.concatenate([np.arange(n), np.arange(n)])
        sense = np.repeat([1.0, -1.0], n)
        record = now = here[walker]
        ahead = now.spine * sense[:, None]
        tracks = [[i] for i in range(2 * n)]
        first = _FIRST * self.size / np.maximum(now.steepest, 1e-300)
        step, ended = first.copy(), now.remaining_part(ahead, self.size) <= 0
        # Steps that bracket a tip, and the parts of the ball's radius squared that remain at both.
        low, high = np.zeros(2 * n), np.full(2 * n, np.inf)
        left_low, left_high = np.ones(2 * n), np.full(2 * n, np.nan)
        failed = ~good[walker]
        for _ in range(_MOST):
            active = np.flatnonzero(~ended & ~failed)
            if not len(active):
                break
            at, way, aims = now[active], ahead[active], starts[walker[active]]
            near = np.isfinite(high[active])
            h = np.where(near, _secant_steps(*(x[active] for x in (low, high, left_low, left_high))), step[active])
            trial, left, turned, gone, room = self._spine_steps(aims, at, way, h)
            beyond, within = left <= 0, left > 0
            high[active[beyond]], left_high[active[beyond]] = h[beyond], left[beyond]
            low[active[near & within]], left_low[active[near & within]] = h[near & within], left[near & within]
            tip = near & within & (high[active] - h < _AT_TIP * np.maximum(h, first[active]))
            ended[active[tip]] = True
            # A step of which nothing is known is shortened, also before a tip.
            lost = ~np.isfinite(left) | (~near & within & (gone > 1.5 * room))
            step[active[lost]] = h[lost] / 2
            high[active[lost]] = np.inf
            low[active[lost]] = 0.0
            ahead_now = within & ~lost & (~near | tip)
            taken = active[ahead_now]
            for k, i in enumerate(taken.tolist()):
                tracks[i].append(len(record) + k)
            record, now = record.joined(trial[ahead_now]), replaced(now, taken, trial[ahead_now])
            ahead[taken] = turned[ahead_now]
            left_low[taken] = left[ahead_now]
            with np.errstate(invalid="ignore", divide="ignore"):
                step[taken] *= np.clip(room[ahead_now] / gone[ahead_now], 0.5, _GROWTH)
            failed |= step < _SHORTEST * first
        failed |= ~ended
        return [
            None if failed[i] or failed[n + i] else record[np.array([*tracks[n + i][:0:-1], *tracks[i]])]
            for i in range(n)
        ]

    def _spine_steps(
        self, aims: RayAims, at: Passes, way: Float[Array, "n 3"], step: Float[Array, " n"]
    ) -> tuple[Passes, Array, Array, Array, Array]:
        """Places a step further on spines, and quantities there.

        The remaining part to the tip, NaN where it is unknown; the direction of the spine; the change of xi_n and its
        limit, both in radii of the ball.
        """
        aim = np.stack([np.zeros(len(step)), (at.sky * way).sum(axis=1) + step], axis=-1)
        trial, fine = self.rays_through(aims.with_directions(at.sky + step[:, None] * way, at.time), aim, way)
        with np.errstate(invalid="ignore", divide="ignore"):
            turned = trial.spine * np.where((trial.spine * way).sum(axis=1) < 0, -1.0, 1.0)[:, None]
            fine &= (turned * way).sum(axis=1) > _STRAIGHT
            gone = np.abs(trial.place[:, 1] - at.place[:, 1]) / self.size
            room = np.maximum(_FAR * (1 - np.abs(at.place[:, 1]) / self.size), _LEAST_FAR)
        return trial, np.where(fine, trial.remaining_part(way, self.size), np.nan), turned, gone, room

    def _slice_light(self, starts: RayAims, spines: "list[Passes | None]") -> "list[SlicedImage | None]":
        """The light of the slices along spines."""
        cut = [(k, spine) for k, spine in enumerate(spines) if spine is not None and len(spine) > 1]
        images = [None if spine is None else _DARK for spine in spines]
        if not cut:
            return images
        row, e, p, weight, sky, time = _slices([spine for _, spine in cut])
        aims = starts[np.array([k for k, _ in cut])[row]].with_directions(sky, time)
        middle, good = self.rays_through(aims, np.stack([np.zeros(len(p)), p], axis=-1), e)
        _, width, shift, side = middle.slices(e, self.size)
        linear = width / np.sqrt(1 - p**2) * middle.light
        sides, sure = [], good.copy()
        for sense in (-0.5, 0.5):
            sky = middle.sky + (shift + sense * width)[:, None] * side
            start = aims.with_directions(sky / lengths(sky)[:, None], middle.time)
            edge, fine = self.rays_through(start, np.stack([np.full(len(p), self.size), p], axis=-1), e, limb=True)
            sides.append(edge)
            sure &= fine
        left, right = sides
        turn = np.arctan2((e * np.cross(left.sky, right.sky)).sum(axis=1), (left.sky * right.sky).sum(axis=1) - p**2)
        exact = turn * (left.light + 4 * middle.light + right.light) / 6
        exact = np.where(sure & (width > 0), exact, linear)
        unit = weight / (4 * np.pi**2 * self.size**2)
        total, rough = (np.bincount(row, unit * value, len(cut)) for value in (exact, linear))
        ray_error = np.bincount(row, unit * exact * middle.relative_error, len(cut))
        mean = np.stack([np.bincount(row, unit * exact * middle.sky[:, i], len(cut)) for i in range(3)], axis=-1)
        clean = np.bincount(row, ~good, len(cut)) == 0
        for i, (k, spine) in enumerate(cut):
            tips = spine.sky[[0, -1]]
            error = abs(total[i] - rough[i]) + ray_error[i]
            images[k] = SlicedImage(total[i], error, mean[i] / lengths(mean[i : i + 1])[0], tips) if clean[i] else None
        return images


def _secant_steps(
    low: Float[Array, " n"], high: Float[Array, " n"], left_low: Float[Array, " n"], left_high: Float[Array, " n"]
) -> Float[Array, " n"]:
    """Steps to tips between two steps, by the secant and not too close to either."""
    with np.errstate(invalid="ignore"):
        return low + np.clip(left_low / (left_low - left_high), 0.1, 0.9) * (high - low)


def _slices(spines: list[Passes]) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Slices along spines: which spine, e, p and weight; and guesses of the place on the spine and its time."""
    ends = [(spine[:-1], spine[1:]) for spine in spines]
    first, second = (ends[0][0][:0].joined(*[pair[i] for pair in ends]) for i in (0, 1))
    which = np.repeat(np.arange(len(spines)), [len(spine) - 1 for spine in spines])
    chord = second.sky - first.sky
    size = lengths(chord)
    # A nearly straight spine has one direction; others have one between each two neighbours.
    whole = np.array([spine.sky[-1] - spine.sky[0] for spine in spines])
    whole /= lengths(whole)[:, None]
    own = (chord * whole[which]).sum(axis=1) < _LEAST_COSINE * size
    curved = np.bincount(which, own, len(spines)) > 0
    ahead = np.where(curved[which, None], chord / size[:, None], whole[which])
    low, high = (first.sky * ahead).sum(axis=1), (second.sky * ahead).sum(axis=1)
    begins = np.concatenate([[True], which[1:] != which[:-1]])
    stops = np.concatenate([which[1:] != which[:-1], [True]])
    node = _NODES + 0.5
    # Next to a tip widths are proportional to the square root of the distance from it.
    x = np.where(begins[:, None], node**2, np.where(stops[:, None], 1 - (1 - node) ** 2, node))
    weight = _WEIGHTS * np.where(begins[:, None], 2 * node, np.where(stops[:, None], 2 * (1 - node), 1.0))
    panel = np.repeat(np.arange(len(which)), len(node))
    x, weight = x.ravel(), weight.ravel() * (high - low)[panel]
    sign = [np.sign((place.spine * chord).sum(axis=1))[:, None] * size[:, None] for place in (first, second)]
    way = Cubics(first.sky, chord, first.spine * sign[0], second.spine * sign[1])
    sky = way[panel].points(x)
    time = first.time[panel] + x * (second.time - first.time)[panel]
    p = low[panel] + x * (high - low)[panel]
    return which[panel], ahead[panel], p, weight, sky / lengths(sky)[:, None], time


@dataclass(frozen=True)
class SlicedImage:
    """A part of the image of a ball: its flux with the error, its mean direction, and the tips of its spine."""

    flux: float
    error: float
    sky: Float[Array, " 3"]
    tips: Float[Array, "2 3"]


_DARK = SlicedImage(0.0, 0.0, np.zeros(3), np.full((2, 3), np.nan))
