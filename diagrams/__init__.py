"""Scene, set-ups and experiments, installed as `geoimp_drake.diagrams`."""
