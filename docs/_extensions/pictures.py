"""Makes the pictures of README, gallery and concept pages anew, in docs/pictures/.

    make run
    PYTHONPATH=tests/helpers python docs/_extensions/pictures.py results

Needs Chromium and playwright, as the tests do, and the extra `notebooks` for block diagrams.
"""

import io
import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np
from browser import visit
from PIL import Image
from pydrake.multibody.plant import AddMultibodyPlantSceneGraph
from pydrake.systems.framework import Diagram, DiagramBuilder

from geoimp_drake import (
    DesiredMotion,
    ImpedanceControllerConfig,
    add_wrist_sensor,
    make_impedance_controller,
)
from geoimp_drake.diagrams.scene.cell import add_cell
from geoimp_drake.simulation.notebook import show_diagram

DOCS = Path(__file__).resolve().parents[1]
PICTURES = DOCS / "pictures"


class View(NamedTuple):
    """What is taken of a replay: from a time to another [s], 0 for its end, seen how near."""

    replay: str
    start: float
    end: float = 0.0
    zoom: float = 1.5
    count: int = 1


REPLAYS = {
    "bar.webp": View("bar/internal-impedance", 0.0, 6.5, 1.3, count=24),
    "peg_in_hole.webp": View("peg_in_hole/misplanned", 0.0, zoom=2.6, count=24),
    "plexiglas.webp": View("plexiglas/quaternion", 5.0),
    "singularity.webp": View("singularity/quaternion", 3.0),
    "consistency.webp": View("consistency/quaternion", 3.0),
    "nondiagonal.webp": View("nondiagonal/quaternion", 3.0),
    "redundancy.webp": View("redundancy/with-k-beta", 6.0),
    "disturbance.webp": View("disturbance/inner-loop-exact", 5.0),
    "limits.webp": View("limits/limits-elbow", 3.0),
    "collision.webp": View("collision/all-upper-arm-down", 1.0),
    "frames.webp": View("peg_in_hole/misplanned", 12.0, zoom=4.5),
}
FIGURES = {
    "families.webp": "singularity/comparison.png",
    "orientation_loop.webp": "orientation_loop/comparison.png",
    "energy.webp": "plexiglas/quaternion/energy_audit.png",
}
SIZE, INTERVAL, PAUSE = (400, 300), 125, 1200  # [pixel], [ms], [ms] at the last frame
WIDTH = 800  # of a figure [pixel]
PREPARE = """zoom => {
    viewer.gui.domElement.style.display = 'none';
    viewer.camera.zoom = zoom;
    viewer.camera.updateProjectionMatrix();
    return viewer.animator.duration;
}"""
SHOW = """time => {
    viewer.animator.pause();
    viewer.animator.seek(time);
    viewer.set_dirty();
    return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
}"""


def frames(results: Path, view: View) -> list[Image.Image]:
    """Returns pictures of a replay at equal distances in time."""
    with visit(results / view.replay / "replay.html") as visited:
        page = visited.page
        end = min(view.end or np.inf, page.evaluate(PREPARE, view.zoom))
        pictures = []
        for time in np.linspace(view.start, end, view.count):
            page.evaluate(SHOW, float(time))
            shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
            pictures.append(shot.resize(SIZE, Image.Resampling.LANCZOS))
    return pictures


def save(name: str, pictures: list[Image.Image]) -> None:
    """Writes one picture, or a moving one that stays a while at its end."""
    first, *rest = pictures
    if not rest:
        first.save(PICTURES / name, quality=80)
        return
    durations = [*[INTERVAL] * len(rest), PAUSE]
    first.save(
        PICTURES / name, save_all=True, append_images=rest, duration=durations, loop=0, quality=70
    )


def figure(path: Path) -> Image.Image:
    """Returns a figure of a run, small enough for a page."""
    full = Image.open(path).convert("RGB")
    return full.resize((WIDTH, WIDTH * full.height // full.width), Image.Resampling.LANCZOS)


def controller(scheme: str) -> Diagram:
    """Returns a controller of the cell's arm, of blocks."""
    plant, _ = AddMultibodyPlantSceneGraph(DiagramBuilder(), time_step=1e-3)
    models = add_cell(plant, "single_arm")
    plant.Finalize()
    E = plant.GetFrameByName("disk", models["six_tool"])
    config = ImpedanceControllerConfig(scheme=scheme)
    return make_impedance_controller(plant, models["six"], E, config)


def closed_loop() -> Diagram:
    """Returns plant, sensor, desired motion and a controller that is one compiled system."""
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlantSceneGraph(builder, time_step=1e-3)
    models = add_cell(plant, "single_arm")
    plant.Finalize()
    arm, E = models["six"], plant.GetFrameByName("disk", models["six_tool"])
    config = ImpedanceControllerConfig(form="compiled")
    control = builder.AddSystem(make_impedance_controller(plant, arm, E, config))
    sensor = add_wrist_sensor(builder, plant, plant.GetJointByName("wrist_sensor"), E)
    pose = E.CalcPoseInWorld(plant.CreateDefaultContext())
    desired = builder.AddNamedSystem("desired_motion", DesiredMotion(pose))
    builder.Connect(desired.get_output_port(), control.GetInputPort("desired_motion"))
    builder.Connect(plant.get_state_output_port(arm), control.GetInputPort("estimated_state"))
    builder.Connect(sensor.GetOutputPort("wrench"), control.GetInputPort("wrench"))
    builder.Connect(control.GetOutputPort("actuation"), plant.get_actuation_input_port(arm))
    return builder.Build()


def save_diagram(name: str, diagram: Diagram) -> None:
    """Writes the drawing of a diagram."""
    svg = show_diagram(diagram).svg
    if svg is None:
        raise SystemExit("pip install 'geoimp_drake[notebooks]' for block diagrams")
    (PICTURES / name).write_text(svg, encoding="utf-8")


def main() -> None:
    """Makes those named after the folder of results, or all."""
    results, wanted = Path(sys.argv[1]), set(sys.argv[2:])
    made = {
        name: lambda n=name, v=view: save(n, frames(results, v)) for name, view in REPLAYS.items()
    }
    made |= {
        name: lambda n=name, p=path: save(n, [figure(results / p)])
        for name, path in FIGURES.items()
    }
    made["controller.svg"] = lambda: save_diagram("controller.svg", controller("inner-loop"))
    made["admittance.svg"] = lambda: save_diagram("admittance.svg", controller("admittance"))
    made["closed_loop.svg"] = lambda: save_diagram("closed_loop.svg", closed_loop())
    for name in wanted or made:
        made[name]()


if __name__ == "__main__":
    main()
