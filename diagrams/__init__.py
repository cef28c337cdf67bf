"""The cell and one file per kind of set-up, installed as `geoimp_drake.diagrams`."""
