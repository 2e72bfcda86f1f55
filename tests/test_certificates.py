"""Results that claim to be complete: all say whether that is certified, and what is in doubt."""

import parity
import pytest
from made_results import KINDS, example

import kerrcaustics as kc
from kerrcaustics.curves.caustic import Caustic, CausticSet
from kerrcaustics.extended_sources.magnification import Magnification
from kerrcaustics.images.counts import CountMap, ImageCounts
from kerrcaustics.light_curves.results import LightCurve
from kerrcaustics.results.declared import LAYOUTS, quantities
from kerrcaustics.rings.results import PhotonBand, PhotonRings
from kerrcaustics.rings.visibility import Visibilities
from kerrcaustics.tracks.circles import CircleImages
from kerrcaustics.tracks.events import PairEvents
from kerrcaustics.tracks.following import FollowedStar
from kerrcaustics.tracks.isoradials import IsoradialSet
from kerrcaustics.tracks.lines import LineCrossings
from kerrcaustics.tracks.tracks import StarTracks
from kerrcaustics.waves.amplification import Amplification

CLAIMS = {
    kc.StarImages: "all images of a source up to an index",
    ImageCounts: "the numbers of images of sources",
    CountMap: "the same on a grid",
    PairEvents: "all events on a circle",
    StarTracks: "all tracks of a source, and all events",
    CircleImages: "all images of a great circle",
    LineCrossings: "all crossings of a line",
    IsoradialSet: "the images of all circles",
    LightCurve: "all images of a source on an orbit",
    FollowedStar: "all images of a source, for each viewer",
    Magnification: "all images of a source of finite size",
    Amplification: "the waves of all images of a source",
    Caustic: "a whole curve with its cusps",
    CausticSet: "the curves of all orders that exist",
    PhotonBand: "both edges of a band, each whole",
    PhotonRings: "the bands of all orders",
    Visibilities: "the light of whole bands",
}
"""What a result claims, by class."""


@pytest.mark.parametrize("kind", CLAIMS, ids=lambda kind: kind.__name__)
def test_what_claims_completeness_has_a_certificate_and_remarks(kind):
    declared, layout = quantities(kind), LAYOUTS[kind]
    assert {"certified", "remarks"} <= declared.keys()
    assert declared["certified"].dims or isinstance(example(kind, 2).certified, bool)
    assert isinstance(example(kind, 2).remarks, tuple)
    # The sequence of events is a list in the records of tracks and circles, which have both.
    if kind is not PairEvents:
        entry = kc.record(example(kind, 2), camera=parity.viewer_named("near"))
        assert "remarks" in entry and ("certified" in entry or "certified" in layout.rows)


def test_nothing_else_has_a_certificate():
    certain = {kind for kind in KINDS if "certified" in quantities(kind) or hasattr(kind, "certified")}
    assert certain == {*CLAIMS}


def test_an_order_that_is_lost_is_no_certificate():
    lost = CausticSet((), kc.Camera(0.9, 10.0), "auto", 0.0, 0, {}, missing=(1,))
    assert not lost.certified and lost.remarks == ("order 1: not found",)
    # There is none: from infinity to infinity the primary caustic lies at infinite (alpha, beta).
    none = CausticSet((), kc.Observer(spin=0.9, inclination=1.0), "auto", 0.0, 0, {}, missing=(1,))
    assert none.certified and none.remarks == ()


@pytest.mark.slow
def test_counts_that_were_not_searched_for_say_so():
    camera = kc.Camera(0.9, 10.0)
    stars = [(1.4, 2.9), (0.5, 0.0)]
    counts = kc.image_counts(camera, stars, 1, find=False)
    assert not counts.certified.any()
    assert counts.remarks == ("2 of 2 sources are counted once, without a certificate",)
