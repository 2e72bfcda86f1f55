"""The explorer in a notebook: an anywidget, which shows the same page and keeps its state."""

import math
from collections.abc import Callable
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from kerrcaustics.explorer.answers import greeting, question, refusal
from kerrcaustics.explorer.live_page import notebook_script
from kerrcaustics.explorer.page_data import Message
from kerrcaustics.explorer.state import PAGE, ExplorerState
from kerrcaustics.explorer.work import Work
from kerrcaustics.extras import needed

if TYPE_CHECKING:
    from anywidget import AnyWidget


def explore(
    spin: float = 0.5,
    radius: float = 6.03,
    inclination: float = math.pi / 2,
    velocity: str | None = None,
    *,
    star: tuple[float, float] = (math.radians(84), math.radians(295)),
    size: float = 0.0,
    orders: int = 3,
) -> "AnyWidget":
    """The explorer, as a widget in a notebook: drag the star, and see how pairs of images appear.

    Parameters
    ----------
    spin, radius, inclination, velocity
        The camera to begin with; as for `Camera`, except that velocities cannot be vectors. Spins to 0.9999, radii to
        1000.
    star : (theta', phi')
        Radians.
    size : float
        Radius of the star, radians; 0 for a point.
    orders : int
        Critical curves, 1 to 4; images have Morse index 0 to orders - 1.

    Returns
    -------
    AnyWidget
        `state` is the state of the page as a dict of numbers, degrees; set it, and the page follows. `numbers` are the
        images and the certificate on the page.

    Raises
    ------
    ValueError
        If the state is invalid.
    ImportError
        Without the packages of the extra `notebook`.

    Notes
    -----
    Needs the extra `notebook` (anywidget). `kerrcaustics explore` opens the same page in a browser.

    Examples
    --------
    >>> import kerrcaustics as kc
    >>> kc.explore(spin=0.999, radius=2.6)  # doctest: +SKIP
    """
    from kerrcaustics.spacetime.camera import VELOCITY_NAMES, Camera

    camera = Camera(spin, radius, inclination, velocity)
    if not isinstance(camera.velocity, str):
        names = " or ".join((", ".join(VELOCITY_NAMES[:-1]), VELOCITY_NAMES[-1]))
        raise ValueError(f"Argument `velocity` must be {names}, but is {velocity!r}.")
    theta, phi = (math.degrees(angle) for angle in star)
    values = {"spin": camera.spin, "radius": camera.radius, "velocity": camera.velocity, "orders": orders}
    degrees = {"inclination": math.degrees(camera.inclination), "theta": theta, "phi": phi, "size": math.degrees(size)}
    return _widget_class()(ExplorerState.from_values({**values, **degrees}))


class _Answering:
    """The part of the widget that answers the page, for a class with the messages and the traits of anywidget."""

    state: dict[str, Any]
    numbers: dict[str, Any]
    send: Callable[..., None]

    def _answer(self, _widget: Any, content: Any, _buffers: Any) -> None:
        content = content if isinstance(content, dict) else {}
        if content.get("kind") == "hello":
            self._reply(greeting())
            return
        try:
            asked = question(str(content.get("text", "")))
        except ValueError as error:
            self._reply(refusal(error))
            return
        work = Work()
        with work.reported(self._reply):
            message, data = work.answered(asked)
        self._adopt(message.record)
        self._deliver(data)

    def _reply(self, message: Message) -> None:
        self._deliver(message.encoded())

    def _adopt(self, record: dict[str, Any]) -> None:
        if record["kind"] == "view":
            self.state = record["state"]
            self.numbers = self.numbers | {k: record[k] for k in ("images", "caustics") if k in record}

    def _deliver(self, data: bytes) -> None:
        self.send({"kind": "message"}, [data])


@lru_cache(maxsize=1)
def _widget_class() -> Any:
    """The class of the widget, made on demand: anywidget is an extra."""
    anywidget, traitlets = needed("notebook", "anywidget"), needed("notebook", "traitlets")

    class ExplorerWidget(anywidget.AnyWidget, _Answering):
        """The page, and the state that it shows."""

        _esm = notebook_script()
        _css = PAGE / "explorer.css"
        state = traitlets.Dict().tag(sync=True)
        numbers = traitlets.Dict()

        def __init__(self, state: ExplorerState) -> None:
            super().__init__(state=state.record())
            self.on_msg(self._answer)

        @traitlets.validate("state")
        def _checked(self, proposal: Any) -> dict[str, Any]:
            return ExplorerState.from_values(proposal["value"]).record()

    return ExplorerWidget
