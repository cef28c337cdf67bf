"""Blocks and wires of a diagram, as text and as a drawing from left to right by Graphviz."""

import html
import re
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from itertools import zip_longest
from typing import TypeAlias

from pydrake.systems.framework import Diagram, System

__all__ = ["draw", "in_words", "kind_of", "name_of"]

_End: TypeAlias = tuple[System, str]  # a system and the name of its port
_Wire: TypeAlias = tuple[_End, _End]  # from an output to an input

_FONT = 'fontname="Helvetica,Arial,sans-serif" fontsize=11'
_STYLE = f"""
graph [rankdir=LR newrank=true ranksep=0.8 nodesep=0.25]
graph [style=rounded color=gray60 labeljust=l {_FONT}]
node [shape=plain {_FONT}]
edge [arrowsize=0.6 colorscheme=dark28]
"""
_INPUT = 'shape=box style="rounded,filled" fillcolor="#dbe8fb" color="#2f62ad" height=0.25'
_OUTPUT = 'shape=box style="rounded,filled" fillcolor="#ddf0dd" color="#2e7d32" height=0.25'

# In a process of its own, since Graphviz's messages about fonts would appear in a notebook.
_DRAW = (
    "import sys, pygraphviz; graph = pygraphviz.AGraph(sys.stdin.read());"
    "sys.stdout.buffer.write(graph.draw(format='svg', prog='dot'))"
)


def draw(diagram: Diagram, depth: int) -> str:
    """Returns an SVG: blocks with the ports in use, and the diagram's own ports as labels.

    Args:
        diagram: the one to draw.
        depth: how many levels of diagrams are opened.
    """
    done = subprocess.run(
        [sys.executable, "-c", _DRAW],
        input="\n".join(_description(diagram, depth)).encode(),
        capture_output=True,
        check=True,
    )
    svg = done.stdout.decode()
    return svg[svg.index("<svg") :]  # the prolog names a file on the web


def in_words(diagram: Diagram, depth: int) -> str:
    """Returns a text: the blocks, and which port feeds which.

    Args:
        diagram: the one to describe.
        depth: how many levels of diagrams are opened.
    """
    blocks = _blocks(diagram, depth)
    prefix = {diagram: "", **{system: f"{name}." for system, name in blocks.items()}}
    wires = [
        f"  {prefix[source]}{output} -> {prefix[target]}{port}"
        for (source, output), (target, port) in _wires(diagram, depth)
    ]
    return "\n".join(
        [
            f"Diagram {diagram.get_name()}".rstrip(),
            *(f"  {name}: {kind_of(system)}" for system, name in blocks.items()),
            "Connections",
            *wires,
        ]
    )


def name_of(system: System) -> str:
    """Returns a system's name, or its class if Drake named it after its address in memory."""
    name = system.get_name()
    return kind_of(system) if not name or "@" in name else name


def kind_of(system: System) -> str:
    """Returns the name of a system's class without its module, namespace and scalar type."""
    return re.split(r"::|\.", re.sub(r"<.*>", "", system.GetSystemType()))[-1]


def _blocks(diagram: Diagram, depth: int, within: str = "") -> dict[System, str]:
    """Returns the blocks of a diagram with their names, such as `arm/motion_control`."""
    blocks: dict[System, str] = {}
    for system in diagram.GetSystems():
        if depth > 1 and isinstance(system, Diagram):
            blocks |= _blocks(system, depth - 1, f"{within}{name_of(system)}/")
        else:
            blocks[system] = within + name_of(system)
    return blocks


def _wires(diagram: Diagram, depth: int) -> list[_Wire]:
    """Returns the wires among the blocks; the diagram's own ports are ends of wires, too."""
    wires = [
        ((diagram, port.get_name()), taker)
        for port in map(diagram.get_input_port, range(diagram.num_input_ports()))
        for taker in _takers(diagram, port.get_index(), depth)
    ]
    wires += [
        (_giver(diagram, port.get_index(), depth), (diagram, port.get_name()))
        for port in map(diagram.get_output_port, range(diagram.num_output_ports()))
    ]
    wires += _inner_wires(diagram, depth)
    order = {system: k for k, system in enumerate([diagram, *_blocks(diagram, depth)])}
    # Drake lists them in the order of addresses in memory.
    return sorted(wires, key=lambda wire: [(order[system], port) for system, port in wire])


def _inner_wires(diagram: Diagram, depth: int) -> Iterator[_Wire]:
    for (target, port), (source, output) in diagram.connection_map().items():
        for taker in _takers(target, port, depth - 1):
            yield _giver(source, output, depth - 1), taker
    for system in diagram.GetSystems():
        if depth > 1 and isinstance(system, Diagram):
            yield from _inner_wires(system, depth - 1)


def _takers(system: System, port: int, depth: int) -> list[_End]:
    """Returns the inputs of blocks that an input of a system leads to."""
    if depth == 0 or not isinstance(system, Diagram):
        return [(system, system.get_input_port(port).get_name())]
    locators = system.GetInputPortLocators(port)
    return [end for inner, k in locators for end in _takers(inner, k, depth - 1)]


def _giver(system: System, port: int, depth: int) -> _End:
    """Returns the output of a block that an output of a system comes from."""
    if depth == 0 or not isinstance(system, Diagram):
        return system, system.get_output_port(port).get_name()
    inner, k = system.get_output_port_locator(port)
    return _giver(inner, k, depth - 1)


def _description(diagram: Diagram, depth: int) -> Iterator[str]:
    """Yields the drawing in Graphviz's language, where `e` is a node's right and `w` its left."""
    wires = _wires(diagram, depth)
    keys = {system: f"block{k}" for k, system in enumerate(_blocks(diagram, depth))}
    colors = {source: 1 + k % 8 for k, source in enumerate(dict.fromkeys(s for s, _ in wires))}
    yield f"digraph {{ {_STYLE}"
    yield from _boxes(diagram, keys, wires)
    for (source, output), (target, port) in wires:
        tail, head = f'{keys.get(source)}:"y {output}":e', f'{keys.get(target)}:"u {port}":w'
        if source is diagram:
            tail = f'"in {output}":e'
            yield f'"in {output}" [label="{output}" {_INPUT}]'
        if target is diagram:
            head = f'"out {port}":w'
            yield f'"out {port}" [label="{port}" {_OUTPUT}]'
        yield f"{tail} -> {head} [color={colors[source, output]}]"
    yield "}"


def _boxes(
    diagram: Diagram, keys: Mapping[System, str], wires: Sequence[_Wire], frame: str = "cluster"
) -> Iterator[str]:
    """Yields the blocks; those of a diagram that is opened have a frame around them."""
    for k, system in enumerate(diagram.GetSystems()):
        if system in keys:
            yield f"{keys[system]} [label=<{_box(system, wires)}>]"
        else:
            yield f'subgraph {frame}_{k} {{ label="{name_of(system)}"'
            yield from _boxes(system, keys, wires, f"{frame}_{k}")
            yield "}"


def _box(system: System, wires: Sequence[_Wire]) -> str:
    """Returns a table: name and class, then inputs in use on the left and outputs on the right."""
    sources, targets = {source for source, _ in wires}, {target for _, target in wires}
    inputs = [system.get_input_port(k).get_name() for k in range(system.num_input_ports())]
    outputs = [system.get_output_port(k).get_name() for k in range(system.num_output_ports())]
    rows = zip_longest(
        [_cell("u", "left", name) for name in inputs if (system, name) in targets],
        [_cell("y", "right", name) for name in outputs if (system, name) in sources],
        fillvalue="<td></td>",
    )
    name, kind = html.escape(name_of(system)), html.escape(kind_of(system))
    title = f'<td colspan="2" bgcolor="gray92" sides="b" border="1"><b>{name}</b><br/>{kind}</td>'
    ports = "".join(f"<tr>{left}{right}</tr>" for left, right in rows)
    # The outer table keeps passing wires at a distance.
    return (
        '<table border="0" cellborder="0" cellpadding="9" cellspacing="0"><tr><td>'
        '<table cellborder="0" cellpadding="3" cellspacing="0" bgcolor="white">'
        f"<tr>{title}</tr>{ports}</table></td></tr></table>"
    )


def _cell(side: str, align: str, name: str) -> str:
    name = html.escape(name)
    return f'<td port="{side} {name}" align="{align}">{name}</td>'
