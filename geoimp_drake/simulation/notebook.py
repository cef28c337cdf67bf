"""Block diagrams and Meshcat scenes in notebooks, without a network.

In a notebook the value of a cell's last line is displayed; in a script `print` it.
"""

import html
import importlib.util
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.extras import how_to_install
from geoimp_drake.simulation.block_diagram import draw, in_words, kind_of, name_of

__all__ = ["BlockDiagram", "MeshcatView", "recording", "show_diagram", "show_meshcat"]


@dataclass(frozen=True, repr=False)
class BlockDiagram:
    """A drawing of a diagram: SVG in a notebook; text elsewhere or without Graphviz."""

    svg: str | None
    text: str

    def __repr__(self) -> str:
        return self.text

    def _repr_svg_(self) -> str | None:
        return self.svg


@dataclass(frozen=True, repr=False)
class MeshcatView:
    """A scene with its recorded motion: a page of its own in a notebook, its address elsewhere."""

    page: str  # HTML that needs no network and no Meshcat any more
    url: str
    height: int

    def __repr__(self) -> str:
        return f"Meshcat at {self.url}"

    def _repr_html_(self) -> str:
        style = f"width: 100%; height: {self.height}px; border: none"
        return f'<iframe style="{style}" srcdoc="{html.escape(self.page)}"></iframe>'


def show_diagram(diagram: Diagram, max_depth: int = 1) -> BlockDiagram:
    """Returns a drawing of a diagram from left to right: blocks, the ports in use and wires.

    The diagram's own ports are rounded labels, blue for inputs and green for outputs. A signal has
    the same colour wherever it goes. Graphviz makes the layout (pygraphviz, of the extra
    `notebooks`); without it there is only the text.

    Args:
        diagram: the one to draw; give names to its systems.
        max_depth: how many levels are drawn; 1 for the top level, 2 to look into its diagrams.

    Raises:
        ConfigurationError: it is not a Diagram but a single block.
    """
    if not isinstance(diagram, Diagram):
        raise ConfigurationError(
            f"'{name_of(diagram)}' is a single {kind_of(diagram)} and has no blocks within; give a "
            f"Diagram. A controller of the form `blocks` is one."
        )
    text = in_words(diagram, max_depth)
    if importlib.util.find_spec("pygraphviz") is None:
        return BlockDiagram(None, f"{text}\nFor a drawing: {how_to_install('notebooks')}")
    return BlockDiagram(draw(diagram, max_depth), text)


def show_meshcat(meshcat: Meshcat, height: int = 420) -> MeshcatView:
    """Returns Meshcat's present scene as a page, with the motion that was recorded.

    Args:
        meshcat: the scene; it may be closed afterwards.
        height: of the view in the notebook [pixel].
    """
    return MeshcatView(meshcat.StaticHtml(), meshcat.web_url(), height)


@contextmanager
def recording(meshcat: Meshcat) -> Iterator[None]:
    """Records the motion within a `with` block; the scene can play it afterwards."""
    meshcat.StartRecording(frames_per_second=32.0, set_visualizations_while_recording=False)
    try:
        yield
    finally:
        meshcat.StopRecording()
        meshcat.PublishRecording()
