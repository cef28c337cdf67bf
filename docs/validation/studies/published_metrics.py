"""Makes the figure of metrics that others publish, and prints their table.

python docs/validation/studies/published_metrics.py [FOLDER]

FOLDER, for the runs' journal, the table and the figure, is results/published_metrics by default.
"""

import shutil
import sys
from pathlib import Path

from geoimp_drake.diagrams.experiments.published_metrics import PublishedMetricsSection
from geoimp_drake.simulation.claims import format_claims

PAGE = Path(__file__).resolve().parents[1]

if __name__ == "__main__":
    out = Path(*sys.argv[1:2] or ("results", "published_metrics"))
    result = PublishedMetricsSection().run(out, 1, ())
    shutil.copy(out / f"{result.figure}.png", PAGE)
    print((out / f"{result.name}.csv").read_text(encoding="utf-8"))
    print(format_claims(list(result.claims)))
