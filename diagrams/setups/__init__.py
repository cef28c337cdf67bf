"""One file a kind of set-up, and what they share."""
