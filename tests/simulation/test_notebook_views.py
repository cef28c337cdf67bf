"""What notebooks show: block diagrams, with Graphviz and without, and scenes without a network."""

import html
import re
import stat
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from pydrake.geometry import Box, Meshcat, Rgba
from pydrake.math import RigidTransform
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Adder, ConstantVectorSource, Integrator, LogVectorOutput

from geoimp_drake.errors import ConfigurationError
from geoimp_drake.simulation.notebook import recording, show_diagram, show_meshcat

SVG = "{http://www.w3.org/2000/svg}"


def loop():
    """A source (twice) and an integrator feed a sum, which feeds the integrator and a logger."""
    builder = DiagramBuilder()
    source = builder.AddNamedSystem("source", ConstantVectorSource([1.0]))
    memory = builder.AddNamedSystem("memory", Integrator(1))
    total = builder.AddNamedSystem("sum", Adder(3, 1))
    builder.Connect(source.get_output_port(), total.get_input_port(0))
    builder.Connect(memory.get_output_port(), total.get_input_port(1))
    builder.Connect(source.get_output_port(), total.get_input_port(2))
    builder.Connect(total.get_output_port(), memory.get_input_port())
    LogVectorOutput(total.get_output_port(), builder)
    builder.ExportOutput(total.get_output_port(), "result")
    diagram = builder.Build()
    diagram.set_name("loop")
    return diagram


def words(svg):
    return [
        text
        for element in ElementTree.fromstring(svg).iter(f"{SVG}text")
        for text in element.itertext()
    ]


@pytest.fixture
def without_graphviz(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    return tmp_path


def test_text_names_the_blocks_and_every_connection():
    lines = repr(show_diagram(loop())).splitlines()
    assert lines[0] == "Diagram loop"
    assert lines[1:5] == [
        "  source: ConstantVectorSource",
        "  memory: Integrator",
        "  sum: Adder",
        "  VectorLogSink: VectorLogSink",
    ]
    assert [line.split() for line in lines[6:]] == [
        ["memory.y0", "->", "sum.u1"],
        ["source.y0", "->", "sum.u0"],
        ["source.y0", "->", "sum.u2"],
        ["sum.sum", "->", "VectorLogSink.data"],
        ["sum.sum", "->", "memory.u0"],
    ]


def test_without_graphviz_every_block_and_every_arrow_is_drawn(without_graphviz):
    svg = show_diagram(loop())._repr_svg_()
    assert {"source", "memory", "sum", "Adder", "VectorLogSink"} <= set(words(svg))
    groups = [element.get("id") for element in ElementTree.fromstring(svg).iter(f"{SVG}g")]
    patches = [name for name in groups if name and name.startswith("patch_")]
    # The figure's background, a box for each of four blocks, an arrow for each of four pairs.
    assert len(patches) == 1 + 4 + 4
    assert not re.findall(r"@[0-9a-f]{6,}", svg)


def test_without_graphviz_the_drawing_is_the_same_each_time(without_graphviz):
    assert show_diagram(loop()).svg == show_diagram(loop()).svg


def test_graphviz_draws_if_it_is_there(without_graphviz):
    """What Graphviz gets is Drake's description to the depth asked for; its prolog is left out."""
    program = without_graphviz / "dot"
    program.write_text(
        '#!/bin/sh\n/bin/cat > "$(/usr/bin/dirname "$0")/seen"\n'
        'echo \'<?xml version="1.0"?><!DOCTYPE svg><svg id="drawn"/>\'\n'
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    diagram = loop()
    assert show_diagram(diagram, max_depth=0).svg.strip() == '<svg id="drawn"/>'
    assert (without_graphviz / "seen").read_text() == diagram.GetGraphvizString(max_depth=0)


def test_graphviz_that_fails_is_done_without(without_graphviz):
    program = without_graphviz / "dot"
    program.write_text("#!/bin/sh\nexit 1\n")
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    assert "source" in words(show_diagram(loop()).svg)


def test_scene_is_a_page_of_its_own_with_the_recorded_motion():
    meshcat = Meshcat()
    meshcat.SetObject("box", Box(0.1, 0.2, 0.3), Rgba(1, 0, 0, 1))
    still = show_meshcat(meshcat)
    with recording(meshcat):
        for t in np.linspace(0.0, 1.0, 5):
            meshcat.SetTransform("box", RigidTransform([t, 0.0, 0.0]), t)
    moving = show_meshcat(meshcat, height=200)
    assert repr(moving) == f"Meshcat at {meshcat.web_url()}"
    assert len(moving.page) > len(still.page)
    frame = moving._repr_html_()
    (page,) = re.findall(r'srcdoc="([^"]*)"', frame)
    assert html.unescape(page) == moving.page == meshcat.StaticHtml()
    assert "height: 200px" in frame
    assert not re.findall(r'<(?:script|link|img)[^>]+(?:src|href)="(?:https?:)?//', moving.page)


def test_what_was_recorded_before_an_error_is_kept():
    meshcat = Meshcat()
    meshcat.SetObject("box", Box(0.1, 0.2, 0.3), Rgba(1, 0, 0, 1))
    still = meshcat.StaticHtml()

    def fail():
        with recording(meshcat):
            meshcat.SetTransform("box", RigidTransform([1.0, 0.0, 0.0]), 0.5)
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert len(meshcat.StaticHtml()) > len(still)


def test_a_single_block_is_refused_with_what_to_do() -> None:
    source = ConstantVectorSource([1.0])
    source.set_name("source")
    with pytest.raises(ConfigurationError, match=r"'source' is a single .* give a Diagram"):
        show_diagram(source)
