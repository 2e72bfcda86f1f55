"""Star images and counts as JSON-ready records: angles in degrees, errors in radians."""

import math
from typing import Any

import numpy as np

from kerrcaustics.curves.store import camera_record, degrees
from kerrcaustics.spacetime.camera import Camera
from kerrcaustics.stars.circles import CircleCurve, CircleImages
from kerrcaustics.stars.counts import CountMap, ImageCounts
from kerrcaustics.stars.events import PairEvent
from kerrcaustics.stars.images import StarImages
from kerrcaustics.stars.lines import LineCrossings
from kerrcaustics.stars.tracks import StarTracks, Track

IMAGES_SCHEMA = "kerrcaustics/images/1"
COUNTS_SCHEMA = "kerrcaustics/counts/1"
TRACKS_SCHEMA = "kerrcaustics/tracks/1"


def images_record(camera: Camera, found: StarImages) -> dict[str, Any]:
    """The images of one star, schema "kerrcaustics/images/1"."""
    return {
        "schema": IMAGES_SCHEMA,
        **camera_record(camera),
        "max_index": max(found.per_index),
        "star_deg": [degrees(angle) for angle in found.star],
        "certified": found.certified,
        "per_index": _named(found.per_index),
        "expected": _named(found.expected),
        "on_caustic": list(found.on_caustic),
        "remarks": list(found.remarks),
        "images": [
            {
                "sky": found.sky[i].tolist(),
                "phi_deg": math.degrees(found.azimuth[i]),
                "index": int(found.index[i]),
                "parity": int(found.parity[i]),
                "magnification": float(found.magnification[i]),
                "crossings": int(found.crossings[i]),
                "redshift": float(found.redshift[i]),
                "error_rad": float(found.error[i]),
            }
            for i in range(len(found))
        ],
    }


def counts_record(camera: Camera, found: ImageCounts) -> dict[str, Any]:
    """Image counts of stars, schema "kerrcaustics/counts/1"."""
    rows = zip(found.stars, found.counts, found.expected, found.on_caustic, found.certified, strict=True)
    return {
        **_counts_head(camera, "stars", found.counts.shape[1] - 1),
        "certified": bool(found.certified.all()),
        "stars": [
            {
                "star_deg": [degrees(angle) for angle in star],
                "per_index": _named(dict(enumerate(counts))),
                "expected": _named(dict(enumerate(expected))),
                "total": int(counts.sum()),
                "on_caustic": bool(touching),
                "certified": bool(certified),
            }
            for star, counts, expected, touching, certified in rows
        ],
    }


def map_record(camera: Camera, found: CountMap) -> dict[str, Any]:
    """A count map, schema "kerrcaustics/counts/1"."""
    return {
        **_counts_head(camera, "map", found.counts.shape[2] - 1),
        "theta_deg": np.degrees(found.theta).tolist(),
        "phi_deg": np.degrees(found.phi).tolist(),
        "counts": found.counts.tolist(),
        "on_caustic": found.on_caustic.tolist(),
    }


def circle_record(
    camera: Camera, found: CircleImages, line: LineCrossings | None, turn: float, points: bool
) -> dict[str, Any]:
    """The images of a great circle, and its crossings with the line at `turn`, schema "kerrcaustics/counts/1"."""
    entry = {
        **_counts_head(camera, "circle", max(found.per_index)),
        "normal_deg": [degrees(angle) for angle in found.normal],
        "certified": found.certified and (line is None or line.certified),
        "remarks": [*found.remarks, *(line.remarks if line else ())],
        "per_index": _named(found.per_index),
        "curves": [_curve_record(curve, points) for curve in found.curves],
    }
    if line is not None:
        entry["line"] = {
            "turn_deg": degrees(turn),
            "per_index": _named(line.per_index),
            "expected": _named(line.expected),
            "certified": line.certified,
            "crossings": [
                {
                    "sky": line.sky[i].tolist(),
                    "index": int(line.index[i]),
                    "longitude_deg": math.degrees(line.longitude[i]),
                    "error_rad": float(line.error[i]),
                }
                for i in range(len(line.index))
            ],
        }
    return entry


def tracks_record(camera: Camera, found: StarTracks) -> dict[str, Any]:
    """The tracks of a star and its pair events, schema "kerrcaustics/tracks/1".

    A track holds one list for each quantity, of one length; at an event the parity is 0 and the magnification null.
    """
    return {
        "schema": TRACKS_SCHEMA,
        **camera_record(camera),
        "star_theta_deg": degrees(found.theta),
        "max_index": found.max_index,
        "angular_velocity": found.angular_velocity,
        "period": found.period,
        "certified": found.certified,
        "remarks": list(found.remarks),
        "tracks": [_track_record(track) for track in found.tracks],
        "events": [_event_record(event) for event in found.events],
        "ends": [_event_record(event) for event in found.ends],
    }


def _track_record(track: Track) -> dict[str, Any]:
    return {
        "closed": track.closed,
        "turns": track.turns,
        "event_points": list(track.places),
        "sky": track.sky.tolist(),
        "phi_deg": np.degrees(track.azimuth).tolist(),
        "index": track.index.tolist(),
        "parity": track.parity.tolist(),
        "magnification": [value if math.isfinite(value) else None for value in track.magnification.tolist()],
        "redshift": track.redshift.tolist(),
        "error_rad": track.error.tolist(),
    }


def _event_record(event: PairEvent) -> dict[str, Any]:
    return {
        "kind": event.kind,
        "order": event.order,
        "indices": list(event.indices),
        "star_deg": [math.degrees(angle) for angle in event.star],
        "phi_unwrapped_deg": math.degrees(event.azimuth),
        "sky": event.sky.tolist(),
        "time": event.time,
        "error_rad": event.error,
        "at_cusp": event.at_cusp,
        "remarks": list(event.remarks),
    }


def _curve_record(curve: CircleCurve, points: bool) -> dict[str, Any]:
    entry = {
        "index": curve.index,
        "closed": curve.closed,
        "longitude_from_deg": math.degrees(curve.longitude[0]),
        "longitude_to_deg": math.degrees(curve.longitude[0] + curve.sweep),
        "ends": [] if curve.closed else curve.sky[[0, -1]].tolist(),
        "error_rad": curve.error,
    }
    if points:
        entry["sky"] = curve.sky.tolist()
        entry["longitude_deg"] = np.degrees(curve.longitude).tolist()
    return entry


def _counts_head(camera: Camera, kind: str, max_index: int) -> dict[str, Any]:
    return {"schema": COUNTS_SCHEMA, **camera_record(camera), "kind": kind, "max_index": max_index}


def _named(counts: dict[int, Any]) -> dict[str, int]:
    return {str(k): int(count) for k, count in counts.items()}
