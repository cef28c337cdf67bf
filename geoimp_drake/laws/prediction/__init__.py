"""What a sampled controller will do, before it runs: loops about a posture, as matrices."""
