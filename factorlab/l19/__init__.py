"""The course L19, « Perception »: exercises checked, challenges scored, the line follower, the report."""
