"""Train collisions on a straight track, computed with MuJoCo."""
