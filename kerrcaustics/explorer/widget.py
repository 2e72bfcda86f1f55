"""The explorer in a notebook: an anywidget, which shows the same page and keeps its state."""

import math
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from kerrcaustics.explorer.answers import answer, greeting, question, refusal
from kerrcaustics.explorer.page_data import Message
from kerrcaustics.explorer.state import ExplorerState

if TYPE_CHECKING:
    from anywidget import AnyWidget

_PAGE = Path(__file__).parent / "page"


def explore(
    spin: float = 0.999,
    radius: float = 6.03,
    inclination: float = math.pi / 2,
    velocity: str | None = None,
    *,
    star: tuple[float, float] = (math.radians(84), math.radians(60)),
    orders: int = 3,
) -> "AnyWidget":
    """The explorer, as a widget in a notebook: drag the star, and see pairs of images being born.

    Parameters
    ----------
    spin, radius, inclination, velocity
        The camera to begin with; as for `Camera`, but for velocities that are vectors. Spins to 0.9999, radii to 1000.
    star : (theta', phi')
        Radians.
    orders : int
        Critical curves, 1 to 4; images have Morse index 0 to orders - 1.

    Returns
    -------
    AnyWidget
        In `state` what is shown now, as a dict of numbers, degrees; set it, and the page follows. In `numbers` the
        images and the certificate that it shows.

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
    from kerrcaustics.spacetime.camera import Camera

    camera = Camera(spin, radius, inclination, velocity)
    if not isinstance(camera.velocity, str):
        raise ValueError(f"Argument `velocity` must be circular, fiducial or static, but is {velocity!r}.")
    theta, phi = (math.degrees(angle) for angle in star)
    begun = {"spin": camera.spin, "radius": camera.radius, "velocity": camera.velocity, "orders": orders}
    degrees = {"inclination": math.degrees(camera.inclination), "theta": theta, "phi": phi}
    return _widget_class()(ExplorerState.of({**begun, **degrees}))


@lru_cache(maxsize=1)
def _widget_class() -> Any:
    """Made when it is asked for: anywidget is an extra."""
    import anywidget
    import traitlets

    class ExplorerWidget(anywidget.AnyWidget):
        """The page, and the state that it shows."""

        _esm = _PAGE / "explorer.js"
        _css = _PAGE / "explorer.css"
        state = traitlets.Dict().tag(sync=True)
        numbers = traitlets.Dict()

        def __init__(self, state: ExplorerState) -> None:
            super().__init__(state=state.record())
            self.on_msg(self._asked)

        @traitlets.validate("state")
        def _checked(self, proposal: Any) -> dict[str, Any]:
            return ExplorerState.of(proposal["value"]).record()

        def _asked(self, _widget: Any, content: Any, _buffers: Any) -> None:
            if isinstance(content, dict) and content.get("kind") == "hello":
                self._tell(greeting())
                return
            try:
                number, want, state = question(str(content.get("text", "")) if isinstance(content, dict) else "")
            except ValueError as error:
                self._tell(refusal(str(error)))
                return
            self._tell(answer(number, want, state))

        def _tell(self, message: Message) -> None:
            if message.record["kind"] == "view":
                self.state = message.record["state"]
                self.numbers = self.numbers | {
                    k: message.record[k] for k in ("images", "caustics") if k in message.record
                }
            self.send({"kind": "message"}, [message.encoded()])

    return ExplorerWidget
