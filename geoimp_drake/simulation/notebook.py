"""What notebooks show besides figures: block diagrams and Meshcat scenes, without a network.

In a notebook the value of a cell's last line is displayed; in a script `print` it.
"""

import html
import io
import re
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, Rectangle
from pydrake.geometry import Meshcat
from pydrake.systems.framework import Diagram, System

from geoimp_drake.errors import ConfigurationError

__all__ = ["BlockDiagram", "MeshcatView", "recording", "show_diagram", "show_meshcat"]

# Layout of the drawing without Graphviz [inch].
_ROW, _HALF_BLOCK = 0.55, 1.4
_BEND = 0.35  # of an arrow: how far it swings out, as a part of twice its length


@dataclass(frozen=True, repr=False)
class BlockDiagram:
    """A drawing of a diagram: SVG in a notebook, text elsewhere."""

    svg: str
    text: str

    def __repr__(self) -> str:
        return self.text

    def _repr_svg_(self) -> str:
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
    """Returns a drawing of a diagram: Drake's own by Graphviz, or else blocks with arrows.

    Without Graphviz's program `dot` the blocks of the top level are drawn one below the other,
    arrows down on their right and arrows back on their left. The text names every port either way.

    Args:
        diagram: what is drawn; give names to its systems.
        max_depth: of Graphviz's drawing; 1 for the top level, 2 to look into its diagrams.

    Raises:
        ConfigurationError: it is not a Diagram but a single block.
    """
    if not isinstance(diagram, Diagram):
        raise ConfigurationError(
            f"'{_name(diagram)}' is a single {_kind(diagram)} and has no blocks within; give a "
            f"Diagram. A controller of the form `blocks` is one."
        )
    svg = _by_graphviz(diagram.GetGraphvizString(max_depth=max_depth)) or _top_level(diagram)
    return BlockDiagram(svg, _listing(diagram))


def show_meshcat(meshcat: Meshcat, height: int = 420) -> MeshcatView:
    """Returns what Meshcat shows now, with the motion that was recorded, as a page to look at.

    Args:
        meshcat: the scene; it may go away afterwards.
        height: of the view in the notebook [pixel].
    """
    return MeshcatView(meshcat.StaticHtml(), meshcat.web_url(), height)


@contextmanager
def recording(meshcat: Meshcat) -> Iterator[None]:
    """Records what moves within a `with` block, to be played by the scene afterwards."""
    meshcat.StartRecording(frames_per_second=32.0, set_visualizations_while_recording=False)
    try:
        yield
    finally:
        meshcat.StopRecording()
        meshcat.PublishRecording()


def _by_graphviz(description: str) -> str | None:
    """Returns the SVG of a description in Graphviz's language; None if it cannot draw."""
    dot = shutil.which("dot")
    if dot is None:
        return None
    drawn = subprocess.run(
        [dot, "-Tsvg"], input=description, capture_output=True, text=True, check=False
    )
    # The prolog before the drawing names a file on the web.
    return drawn.stdout[drawn.stdout.index("<svg") :] if "<svg" in drawn.stdout else None


def _top_level(diagram: Diagram) -> str:
    """Returns an SVG of a diagram's blocks in a column, an arrow from each to those it feeds."""
    rows = {system: -_ROW * k for k, system in enumerate(diagram.GetSystems())}
    pairs = dict.fromkeys((source, target) for (source, _), (target, _) in _connections(diagram))
    half_width = _HALF_BLOCK + 0.3 + _BEND * _ROW * len(rows) / 2
    height = _ROW * (len(rows) + 0.5)
    figure = Figure(figsize=(2 * half_width, height))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    axes.set_xlim(-half_width, half_width)
    axes.set_ylim(0.75 * _ROW - height, 0.75 * _ROW)
    for system, y in rows.items():
        label = "\n".join(dict.fromkeys((_name(system), _kind(system))))
        corner, size = (-_HALF_BLOCK, y - 0.35 * _ROW), (2 * _HALF_BLOCK, 0.7 * _ROW)
        axes.add_patch(Rectangle(corner, *size, facecolor="white", edgecolor="black"))
        axes.text(0.0, y, label, ha="center", va="center", fontsize=8)
    for source, target in pairs:
        _draw_arrow(axes, rows[source], rows[target])
    drawing = io.StringIO()
    with rc_context({"svg.fonttype": "none", "svg.hashsalt": "geoimp_drake"}):
        figure.savefig(drawing, format="svg", metadata={"Date": None})
    svg = drawing.getvalue()
    return svg[svg.index("<svg") :]


def _draw_arrow(axes: Axes, begin: float, end: float) -> None:
    """Draws an arrow between two rows: on the right if it leads down, else on the left."""
    x = _HALF_BLOCK if end < begin else -_HALF_BLOCK
    arrow = FancyArrowPatch(
        (x, begin),
        (x, end),
        connectionstyle=f"arc3,rad={-_BEND}",
        arrowstyle="-|>",
        mutation_scale=9,
        shrinkA=0,
        shrinkB=0,
        linewidth=0.8,
    )
    axes.add_patch(arrow)


def _listing(diagram: Diagram) -> str:
    """Returns the top level as text: its blocks and which output feeds which input."""
    blocks = [f"  {_name(system)}: {_kind(system)}" for system in diagram.GetSystems()]
    arrows = [
        f"  {_name(source)}.{output} -> {_name(target)}.{port}"
        for (source, output), (target, port) in _connections(diagram)
    ]
    return "\n".join([f"Diagram {diagram.get_name()}".rstrip(), *blocks, "Connections", *arrows])


def _connections(diagram: Diagram) -> list[tuple[tuple[System, str], tuple[System, str]]]:
    """Returns source and target of every connection, each a system and the name of its port."""
    found = [
        (
            (source, source.get_output_port(output).get_name()),
            (target, target.get_input_port(port).get_name()),
        )
        for (target, port), (source, output) in diagram.connection_map().items()
    ]
    return sorted(found, key=lambda pair: [(_name(s), port) for s, port in pair])


def _name(system: System) -> str:
    """Returns a system's name; the class of one that has none but its place in memory."""
    name = system.get_name()
    return _kind(system) if not name or "@" in name else name


def _kind(system: System) -> str:
    """Returns the name of a system's class without its module, namespace and scalar type."""
    return re.split(r"::|\.", re.sub(r"<.*>", "", system.GetSystemType()))[-1]
