"""Settings of every process that runs tests."""

import gc

# The collector would go through thousands of collected tests, and through the diagrams that Drake
# keeps, again and again: a twentieth of the suite's time.
gc.set_threshold(20_000, 20, 100)
