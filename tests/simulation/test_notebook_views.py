"""What notebooks show: block diagrams from left to right, and scenes without a network."""

import html
import importlib.util
import re
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from pydrake.geometry import Box, Meshcat, Rgba
from pydrake.math import RigidTransform
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import (
    Adder,
    ConstantVectorSource,
    Gain,
    Integrator,
    LogVectorOutput,
)

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


def nested():
    """The loop within a frame: its one output feeds a gain and leaves the diagram."""
    builder = DiagramBuilder()
    inner = builder.AddSystem(loop())
    gain = builder.AddNamedSystem("gain", Gain(2.0, 1))
    builder.Connect(inner.get_output_port(), gain.get_input_port())
    builder.ExportInput(builder.AddNamedSystem("spare", Gain(3.0, 1)).get_input_port(), "given")
    builder.ExportOutput(gain.get_output_port(), "doubled")
    return builder.Build()


def places(svg):
    """Returns where each text of a drawing begins, ends or has its middle [pt]."""
    return {
        element.text: (float(element.get("x")), float(element.get("y")))
        for element in ElementTree.fromstring(svg).iter(f"{SVG}text")
    }


def wires_and_nodes(svg):
    groups = [g.get("class") for g in ElementTree.fromstring(svg).iter(f"{SVG}g")]
    return groups.count("edge"), groups.count("node")


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
        ["source.y0", "->", "sum.u0"],
        ["source.y0", "->", "sum.u2"],
        ["memory.y0", "->", "sum.u1"],
        ["sum.sum", "->", "result"],
        ["sum.sum", "->", "memory.u0"],
        ["sum.sum", "->", "VectorLogSink.data"],
    ]


def test_a_diagram_within_is_one_block_or_its_own_blocks():
    closed, opened = (repr(show_diagram(nested(), max_depth=depth)) for depth in (1, 2))
    assert "  loop: Diagram" in closed
    assert "  loop.result -> gain.u0" in closed
    assert "loop/source" not in closed
    assert "  loop/sum: Adder" in opened
    assert "  loop/sum.sum -> gain.u0" in opened
    assert "  loop/memory.y0 -> loop/sum.u1" in opened
    assert "  gain.y0 -> doubled" in opened
    assert "  given -> spare.u0" in opened


def test_drawing_names_blocks_and_ports_and_has_every_wire():
    svg = show_diagram(loop())._repr_svg_()
    ports = {"y0", "u0", "u1", "u2", "sum", "data", "result"}
    assert {"source", "memory", "Adder", "VectorLogSink", *ports} <= places(svg).keys()
    assert wires_and_nodes(svg) == (6, 4 + 1)
    assert svg.startswith("<svg")
    assert not re.findall(r"@[0-9a-f]{6,}", svg)


def test_drawing_leads_from_left_to_right():
    drawn = places(show_diagram(nested(), max_depth=2).svg)
    for wire in (("source", "Adder"), ("Adder", "gain"), ("gain", "doubled"), ("given", "spare")):
        (x_0, y_0), (x_1, y_1) = (drawn[text] for text in wire)
        assert x_1 - x_0 > abs(y_1 - y_0)


def test_a_frame_is_around_the_blocks_of_a_diagram_that_is_opened():
    (frame,) = (
        group
        for group in ElementTree.fromstring(show_diagram(nested(), max_depth=2).svg).iter(f"{SVG}g")
        if group.get("class") == "cluster"
    )
    numbers = re.findall(r"-?[\d.]+", frame.find(f"{SVG}path").get("d"))
    low, high = min(map(float, numbers[::2])), max(map(float, numbers[::2]))
    drawn = places(show_diagram(nested(), max_depth=2).svg)
    assert low < drawn["source"][0] < drawn["Adder"][0] < high < drawn["doubled"][0]


def test_ports_that_are_not_in_use_are_left_out():
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, 1e-3)
    plant.Finalize()
    svg = show_diagram(builder.Build()).svg
    assert "geometry_query" in places(svg)
    assert "contact_results" not in places(svg)


def test_drawing_is_the_same_each_time():
    assert show_diagram(nested(), max_depth=2).svg == show_diagram(nested(), max_depth=2).svg


def test_drawing_says_nothing_beside(capfd):
    show_diagram(loop())
    assert capfd.readouterr() == ("", "")


def test_without_graphviz_the_text_says_how_to_get_a_drawing(monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    shown = show_diagram(loop())
    assert shown._repr_svg_() is None
    assert "sum.sum -> memory.u0" in repr(shown)
    assert repr(shown).endswith("pip install 'geoimp-drake[notebooks]'.")


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
