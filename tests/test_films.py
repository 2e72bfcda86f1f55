"""Films: written, decoded again, continued after an interruption; frames of an orbit show what happens."""

import heapq
import math
from contextlib import nullcontext
from itertools import pairwise
from types import SimpleNamespace

import av
import numpy as np
import pytest
from command_line import run
from marks import few
from matplotlib.colors import to_rgba
from PIL import Image

import kerrcaustics as kc
from kerrcaustics.draw import style
from kerrcaustics.draw.caustic_films import Mapping, caustics_frame
from kerrcaustics.draw.films import SIZE, Film, write_film
from kerrcaustics.draw.orbit_films import OrbitFrames
from kerrcaustics.draw.projection import azimuthal_equidistant, view_axes
from kerrcaustics.films import film as film_module, frame_store
from kerrcaustics.films.film import FilmResult, FramesFailed, frames_folder, make_film
from kerrcaustics.results.time_left import TimeLeft
from kerrcaustics.scripts import FILMS

FRAMES = 12
SCRIPT = """
from kerrcaustics.draw.films import Film
import numpy as np

def film(frames=5):
    return Film("grey", {}, frames, 25, lambda n: np.full((48, 96, 3), 60 + 20 * n, np.uint8))
"""


def small_film(draw=None, settings=None) -> Film:
    """A bright bar that moves to the right."""

    def bar(number: int) -> np.ndarray:
        picture = np.full((48, 96, 3), 40, np.uint8)
        picture[:, 8 * number : 8 * number + 8] = 250
        return picture

    return Film("bar", settings or {"speed": 8}, FRAMES, 25, draw or bar)


def decoded(path) -> list[np.ndarray]:
    if path.suffix == ".gif":
        with Image.open(path) as film:
            frames = []
            for number in range(film.n_frames):
                film.seek(number)
                frames.append(np.asarray(film.convert("RGB")))
        return frames
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.average_rate == 25
        return [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]


@pytest.mark.parametrize("ending", ["mp4", "gif"])
def test_a_film_can_be_seen(tmp_path, ending):
    film = small_film()
    path = write_film(tmp_path / f"bar.{ending}", film)
    frames = decoded(path)
    assert len(frames) == FRAMES
    for number, frame in enumerate(frames):
        assert frame.shape == (48, 96, 3)
        assert np.abs(frame.astype(int) - film.draw(number)).mean() < 12
        assert frame.mean() > 30
    assert np.abs(frames[0].astype(int) - frames[-1]).mean() > 20
    # Nothing is left beside it.
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def test_an_interrupted_film_goes_on(tmp_path):
    whole, drawn = small_film(), []

    def interrupted(number: int) -> np.ndarray:
        drawn.append(number)
        if len(drawn) == 8:
            raise KeyboardInterrupt
        return whole.draw(number)

    path = tmp_path / "bar.mp4"
    with pytest.raises(KeyboardInterrupt):
        write_film(path, small_film(interrupted))
    assert not path.exists() and frames_folder(path).is_dir()
    write_film(path, small_film(interrupted))
    # The frame that failed is the only one drawn twice.
    assert drawn == [*range(8), *range(7, FRAMES)]
    undisturbed = write_film(tmp_path / "other.mp4", whole)
    assert path.read_bytes() == undisturbed.read_bytes()


def test_frames_of_other_settings_are_not_taken_and_not_thrown_away(tmp_path):
    path, drawn = tmp_path / "bar.gif", []

    def broken(number: int) -> np.ndarray:
        if number == 5:
            raise RuntimeError
        return np.zeros((48, 96, 3), np.uint8)

    with pytest.raises(FramesFailed, match="1 of 12 frames failed: frame 5: RuntimeError"):
        write_film(path, small_film(broken, {"speed": 1}))
    film = small_film()
    counted = Film(film.name, film.settings, FRAMES, 25, lambda n: drawn.append(n) or film.draw(n))
    kept = sorted(frames_folder(path).iterdir())
    with pytest.raises(ValueError, match=r"of another film \(speed: 8 here, 1 there\). Restart"):
        write_film(path, counted)
    assert drawn == [] and set(kept) - set(frames_folder(path).iterdir()) == {frames_folder(path) / "000005.failed"}
    write_film(path, counted, restart=True)
    assert drawn == list(range(FRAMES))


def test_a_film_says_its_progress_as_other_calls_do(tmp_path, monkeypatch):
    heard, bar_heard = [], []
    make_film(tmp_path / "one.gif", small_film(), progress=lambda *what: heard.append(what))
    monkeypatch.setattr("kerrcaustics.results.progress.bar", lambda _after: nullcontext(lambda *w: bar_heard.append(w)))
    write_film(tmp_path / "two.gif", small_film(), progress=True)
    assert heard == bar_heard and heard[0] == ("0 of 12 frames", 0.0) and heard[-1] == ("done", 1.0)
    assert ("7 of 12 frames", 7 / 12) in heard and ("writing the film", 1.0) in heard
    with pytest.raises(ValueError, match="Argument `progress` must be True, False or a function"):
        make_film(tmp_path / "three.gif", small_film(), progress="yes")  # pyright: ignore[reportArgumentType]


def timed_film(tmp_path, monkeypatch, seconds, frames, workers=1, late=2):
    """Announcements, and the estimates of the time left with the true ones: frames of so many seconds each.

    late: the round of frames in which the processes load once more.
    """
    clock = SimpleNamespace(now=0.0, drawing=0.0)
    monkeypatch.setattr(film_module, "time", SimpleNamespace(perf_counter=lambda: clock.now))
    monkeypatch.setattr(frame_store, "clock", lambda: clock.drawing)
    order, announced, reports, costs = [], [], [], {}

    def in_processes(compute, numbers, _worker_failures):
        waiting, crew, rounds = iter(numbers), [(0.0, process, None) for process in range(workers)], [0] * workers
        while crew:
            clock.now, process, number = heapq.heappop(crew)
            if number is not None:
                if rounds[process] == 1:
                    frame_store.WARM.clear()
                compute(number)
                order.append(number)
                yield number, True
            following = next(waiting, None)
            if following is not None:
                # Each process loads before its first frame, and once more later.
                costs[following] = seconds(following) + {0: 90.0, late: 60.0}.get(rounds[process], 0.0)
                rounds[process] += 1
                heapq.heappush(crew, (clock.now + costs[following], process, following))

    def draw(number):
        clock.drawing += costs[number]
        return picture

    picture = np.zeros((48, 96, 3), np.uint8)
    monkeypatch.setattr(film_module, "place", lambda *_: in_processes)
    estimate = TimeLeft(workers)

    def report(_what, part):
        estimate.note(clock.now, part)
        reports.append((clock.now, estimate.seconds_left(clock.now)))

    film = Film("still", {}, frames, 25, draw)
    options = {"workers": workers} if workers > 1 else {}
    path = tmp_path / f"still{workers}.gif"
    make_film(path, film, progress=report, announce=lambda *what: announced.append((clock.now, *what)), **options)
    # The last reports are about the file.
    return order, announced, [(left, clock.now - now) for now, left in reports if now < clock.now], clock.now


@pytest.mark.parametrize("workers", few((1, 2, 3), (2,)))
@pytest.mark.parametrize(
    "seconds",
    few(
        (lambda _n: 5.0, lambda n: 5 + n / 8, lambda n: 20 - n / 8, lambda n: 4 + 12 * math.sin(n / 25) ** 2),
        ("even", "waves"),
        ("even", "growing", "falling", "waves"),
    ),
)
def test_the_time_left_is_within_a_third_of_the_true_one(tmp_path, monkeypatch, seconds, workers):
    order, announced, times, end = timed_film(tmp_path, monkeypatch, seconds, 120, workers)
    assert sorted(order) == list(range(120)) and order != sorted(order)
    # Said once, when a second frame of each process is drawn, and true to a third although the first took 90 s more.
    ((now, line, left),) = announced
    assert 2 * workers <= sum(0 < end - true < now + 1e-6 for _, true in times) <= 3 * workers
    places = f" on {workers} processes" if workers > 1 else ""
    assert line.startswith("About ") and f" a frame; 120 frames{places}: " in line
    # At the end, when the last round is overdue, nothing is said.
    assert len([none for none, true in times if none is None and true > 10]) <= 2 * workers + 2
    known = [(left, true) for left, true in times[8 * workers :] if true > 30]
    assert len(known) > 60 and all(2 / 3 < left / true < 4 / 3 for left, true in known)
    assert 2 / 3 < left / (end - now) < 4 / 3


@pytest.mark.parametrize("workers", few((1, 2, 3), (2,)))
def test_an_announcement_is_mended_where_the_second_frame_loaded_too(tmp_path, monkeypatch, workers):
    _, announced, _, end = timed_film(tmp_path, monkeypatch, lambda _n: 5.0, 120, workers, late=1)
    (_, first, far_off), (now, mended, left) = announced
    assert far_off > 10 * left and first.startswith("About 65 s a frame") and mended.startswith("About 5 s a frame")
    assert 2 / 3 < left / (end - now) < 4 / 3


def test_a_short_film_says_nothing_and_keeps_the_order(tmp_path, monkeypatch):
    order, announced, _, _ = timed_film(tmp_path, monkeypatch, lambda _n: 0.1, 20)
    assert order == list(range(20)) and announced == []


def test_bad_input(tmp_path):
    with pytest.raises(ValueError, match=r"Argument `path` must end in .mp4 or .gif"):
        write_film(tmp_path / "film.avi", small_film())
    with pytest.raises(ValueError, match="Argument `path` must lie in a folder"):
        write_film(tmp_path / "none" / "film.mp4", small_film())
    for picture in (np.zeros((47, 96, 3), np.uint8), np.zeros((48, 96)), np.zeros((48, 96, 3))):
        with pytest.raises(ValueError, match="even height and width"):
            write_film(tmp_path / "film.mp4", small_film(lambda _n, picture=picture: picture))


@pytest.fixture(scope="module")
def orbit() -> OrbitFrames:
    camera = kc.Camera(0.999, 6.03)
    return OrbitFrames(kc.star_tracks(camera, math.radians(77), 2), kc.caustics(camera, orders=3), 120)


@pytest.mark.slow
def test_an_orbit_is_whole_and_in_order(orbit):
    steps = np.diff(orbit.times)
    assert (steps > 0).all() and orbit.times[-1] - orbit.times[0] < orbit.tracks.period
    shown = {(event.kind, event.order) for event in orbit.events.values()}
    assert shown == {(kind, order) for kind in ("creation", "annihilation") for order in (2, 3)}
    for number, event in orbit.events.items():
        assert orbit.times[number] % orbit.tracks.period == pytest.approx(event.moment, abs=1e-9)
        before, after = orbit.images[number - 1].per_index, orbit.images[number + 1].per_index
        change = {k: after[k] - before[k] for k in after}
        sign = 1 if event.kind == "creation" else -1
        assert change == {k: sign * (k in event.indices) for k in change}


@pytest.mark.slow
def test_a_pair_is_born_on_the_critical_curve_to_a_pixel(orbit):
    number = next(n for n, event in orbit.events.items() if (event.kind, event.order) == ("creation", 2))
    orbit.show(number)
    ax, curve = orbit.axes[0], orbit.caustics[1]
    view = view_axes(orbit.tracks.camera, kc.shadow_edge(orbit.tracks.camera, 2000))
    line = ax.transData.transform(azimuthal_equidistant(np.append(curve.sky, curve.sky[:1], axis=0), view))
    fine = np.concatenate([np.linspace(a, b, 20) for a, b in pairwise(line)])
    gaps = []
    for index in (1, 2):
        # The dots of an index have the colour of the order whose curve they lie outside of.
        colour = to_rgba(style.index_colour(index))
        (images,) = (part for part in ax.collections if tuple(part.get_facecolor()[0]) == colour)
        dots = ax.transData.transform(images.get_offsets())
        gaps.append(np.linalg.norm(dots[:, None] - fine, axis=2).min(axis=1).min())
    assert max(gaps) < 1
    assert "two images are born" in orbit.caption(number)


@pytest.mark.slow
def test_frames_are_pictures(orbit):
    caustics = kc.caustics(kc.Camera(0.999, 2.6), orders=3)
    mapping = Mapping(caustics)
    pictures = [
        [orbit.frame(0), orbit.frame(60)],
        [mapping.frame(0.0), mapping.frame(0.4)],
        [caustics_frame(caustics, "one"), caustics_frame(kc.caustics(kc.Camera(0.0, 6.0), orders=2), "other")],
    ]
    for first, other in pictures:
        for picture in (first, other):
            assert picture.shape == (SIZE[1], SIZE[0], 3) and picture.dtype == np.uint8
            assert 150 < picture.mean() < 254
        assert (first != other).any()


@pytest.mark.slow
@pytest.mark.parametrize("name", FILMS.names())
def test_script_makes_a_film(name, tmp_path):
    film = FILMS.load(name).film(4)
    path = write_film(tmp_path / "film.gif", film)
    frames = decoded(path)
    assert len(frames) == film.frames == 4 and film.rate >= 24
    # The star field has a size of its own.
    size = film.settings.get("size", SIZE)
    assert all(frame.shape == (size[1], size[0], 3) for frame in frames)
    assert min(frame.mean() for frame in frames) > 5
    assert (frames[0] != frames[-1]).any()


def test_command_makes_a_film(tmp_path, scripts_at, capsys):
    (tmp_path / "grey.py").write_text(SCRIPT)
    scripts_at("FILMS", tmp_path)
    path = tmp_path / "new.gif"
    status, out, err = run(capsys, "film", "grey", "--output", path)
    assert (status, err) == (0, "") and str(path) in out
    assert [int(frame.mean()) for frame in decoded(path)] == [60, 80, 100, 120, 140]
    # Its frames are drawn by another process, which loads the script itself.
    assert run(capsys, "film", "grey", "--frames", 3, "--workers", 1, "--output", path)[0] == 0
    assert [int(frame.mean()) for frame in decoded(path)] == [60, 80, 100]


@pytest.mark.slow
def test_templates_are_films_by_name(capsys, monkeypatch):
    made = []

    def filmed(path, film, **options):
        made.append((path.name, film))
        return FilmResult(path, frames_folder(path), film.frames, 0, film.frames, (), 0.0)

    monkeypatch.setattr("kerrcaustics.films.film.make_film", filmed)
    # Which is a minute of drawing; test_tones.py has it.
    monkeypatch.setattr("kerrcaustics.scene_files.scene_file.SceneFile.with_exposures", lambda scene: scene)
    for name in ("star_field", "left_edge", "orbit", "approach"):
        assert run(capsys, "film", name)[0] == 0
    assert [path for path, _ in made] == ["star_field.mp4", "left_edge.mp4", "orbit.mp4", "approach.mp4"]
    stars = made[0][1]
    assert (stars.frames, stars.rate, stars.draw.scene.size) == (240, 24, (1280, 720))
    for _, film in made[:3]:
        # A whole orbit: it goes on where it began, after the period of a circular geodesic.
        scene = film.draw.scene
        assert scene.azimuth(scene.span[1]) == pytest.approx(2 * math.pi, abs=1e-6)
        camera = scene.camera(0)
        assert scene.span[1] == pytest.approx(2 * math.pi * (camera.radius**1.5 + camera.spin), rel=1e-7)


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["film", "nothing"], "Argument NAME must be one of all_tracks, approach, descent, film"),
        (["film", "stars"], "Argument NAME must be one of"),
        (["film", "spin", "--frames", "1"], "Argument --frames must be 2 or more"),
        (["film", "spin", "--output", "film.avi"], "Argument --output must end in .mp4 or .gif"),
        (["film", "spin", "--output", "no/such/film.gif"], "Argument --output must name a file in a folder"),
        (
            ["tracks", "--spin", "0.9", "--radius", "6", "--star-theta", "80", "--film", "film.png"],
            "Argument --film must end in .mp4 or .gif",
        ),
    ],
)
def test_command_refuses(arguments, complaint, assert_refused):
    assert_refused(arguments, complaint)
