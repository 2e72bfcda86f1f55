"""Chains: the links of a level curve joined to whole curves, over the events where two images meet or not."""

from dataclasses import dataclass

import numpy as np

from kerrcaustics.lens_map.lens_map import SeenLight
from kerrcaustics.level_curves.branches import Branches
from kerrcaustics.shapes import Float, Int

Array = np.ndarray

_TURN = 2 * np.pi


@dataclass(frozen=True, eq=False)
class Chain:
    """A connected curve: the numbers of its nodes, and their longitudes, continuous along it.

    closed: it leads back to its first node, which is not repeated; sweep: by how much the longitude grows in all.
    """

    nodes: Int[Array, " points"]
    longitude: Float[Array, " points"]
    closed: bool
    sweep: float


def chains(branches: Branches, *, over_events: bool) -> list[Chain]:
    """The curves of a level curve, toward larger longitude on the whole; they end at events, or lead over them."""
    links, nodes = branches.links, branches.nodes
    if branches.still:
        return [Chain(np.array([i]), nodes.longitude[[i]], True, 0.0) for i in range(len(nodes.event))]
    steps = links.longitude(links.p_1) - links.longitude(links.p_0)
    partner = _partners(branches, over_events)
    ends = np.stack([links.left, links.right], axis=-1).ravel()
    used = np.zeros(len(steps), bool)
    joined = []
    # Open chains first, each from one of its ends; what is left is closed.
    starts = [*np.flatnonzero(partner < 0).tolist(), *range(0, 2 * len(steps), 2)]
    for start in starts:
        if used[start // 2]:
            continue
        chain, way, place = [int(ends[start])], [], start
        while place >= 0 and not used[place // 2]:
            used[place // 2] = True
            way.append(steps[place // 2] * (1 - 2 * (place % 2)))
            # To the other end of the link, and from there to the next link.
            chain.append(int(ends[place ^ 1]))
            place = int(partner[place ^ 1])
        joined.append(_chain(nodes.longitude, np.array(chain), np.array(way), closed=place == start))
    return joined


def _chain(
    longitude: Float[Array, " nodes"], chain: Int[Array, " points"], steps: Float[Array, " points-1"], *, closed: bool
) -> Chain:
    """A chain from its nodes, the first one repeated where it is closed, and the steps in longitude between them."""
    if steps.sum() < 0:
        chain, steps = chain[::-1], -steps[::-1]
    run = np.concatenate([[0.0], np.cumsum(steps)])
    kept = chain[:-1] if closed else chain
    along = longitude[kept[0]] + run[: len(kept)]
    # The sum gives the whole turns; each point knows the rest without the sum's round-off.
    along = longitude[kept] + _TURN * np.round((along - longitude[kept]) / _TURN)
    return Chain(kept, along, closed, float(run[-1]))


def _partners(branches: Branches, over_events: bool) -> Int[Array, " ends"]:
    """Ends of links (2 i: left end of link i, 2 i + 1: right end) that meet in a node, each with the one it goes on to.

    -1 where the curve ends. At a cusp four links meet: the two of one index on one side of it make one curve, the other
    two another.
    """
    links, nodes = branches.links, branches.nodes
    ends = np.stack([links.left, links.right], axis=-1).ravel()
    index = np.repeat(links.index, 2)
    order = np.argsort(ends, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(ends[order])) + 1) if len(order) else []
    partner = np.full(len(ends), -1)
    for group in groups:
        event = nodes.event[ends[group[0]]]
        pairs = [group] if event < 0 or over_events else []
        if pairs and event >= 0 and branches.events.at_cusp[event]:
            kinds = [(int(index[i]), int(i % 2)) for i in group]
            twins = np.array([kinds.count(kind) == 2 for kind in kinds])
            pairs = [group[twins], group[~twins]]
        for pair in pairs:
            if len(pair) == 2:
                partner[pair] = pair[::-1]
    return partner


def errors_on_sky(
    branches: Branches, light: SeenLight, event_errors: Float[Array, " events"]
) -> Float[Array, " nodes"]:
    """Errors of the nodes on the sky at rest, radians; event_errors: those of the path_events in longitude."""
    nodes = branches.nodes
    at_event = nodes.event >= 0
    depth = branches.chart.place(np.ones(len(nodes.event), int), nodes.sky)[:, 1]
    # At an event: along the critical curve by the error of its longitude, across by that of the beam's ellipse.
    along = event_errors[nodes.event[at_event]] * np.sin(branches.circle.angle) + light.beams.error[at_event]
    across = np.pi * np.exp(-depth[at_event]) * light.beams.diameter_error[at_event]
    error = nodes.error.copy()
    error[at_event] = along / light.spread[at_event] + across
    return error
