"""Makes a small moving picture (WebP) of a replay, as the README shows them.

    geoimp run bar --html --out results/bar
    python docs/_extensions/animate.py results/bar/replay.html docs/bar.webp

It needs Chromium and playwright, both of which the tests use.
"""

import argparse
import io
import sys
from pathlib import Path

import numpy as np
from PIL import Image

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tests" / "helpers"))
from browser import visit

SIZE = (400, 300)  # [pixel]
PAUSE = 1200  # at the last picture [ms]
# Waits for the picture that belongs to a time of the animation.
SHOW = """time => {
    viewer.animator.pause();
    viewer.animator.seek(time);
    viewer.set_dirty();
    return new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)));
}"""
# The controls would cover the scene.
PREPARE = """zoom => {
    viewer.gui.domElement.style.display = 'none';
    viewer.camera.zoom = zoom;
    viewer.camera.updateProjectionMatrix();
}"""


def frames(options: argparse.Namespace) -> list[Image.Image]:
    """Returns pictures of a replay at equal distances in time."""
    with visit(options.replay) as visited:
        page = visited.page
        page.evaluate(PREPARE, options.zoom)
        end = options.end or page.evaluate("viewer.animator.duration")
        pictures = []
        for time in np.linspace(options.start, end, options.frames):
            page.evaluate(SHOW, float(time))
            shot = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
            pictures.append(shot.resize(SIZE, Image.Resampling.LANCZOS))
    return pictures


def main() -> None:
    """Reads the command line and writes the picture."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("replay", type=Path, help="replay.html of a run")
    parser.add_argument("picture", type=Path, help="the WebP file to write")
    parser.add_argument("--frames", type=int, default=24, help="how many (24)")
    parser.add_argument("--start", type=float, default=0.0, help="of the replay [s] (0)")
    parser.add_argument("--end", type=float, help="of the replay [s] (its end)")
    parser.add_argument("--interval", type=int, default=125, help="between frames [ms] (125)")
    parser.add_argument("--zoom", type=float, default=1.0, help="of the camera (1)")
    options = parser.parse_args()
    first, *rest = frames(options)
    durations = [*[options.interval] * len(rest), PAUSE]
    first.save(
        options.picture, save_all=True, append_images=rest, duration=durations, loop=0, quality=70
    )


if __name__ == "__main__":
    main()
