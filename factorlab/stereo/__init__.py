"""Stereo as jobs: calibrate a rig, rectify pairs, turn them into depth; verdicts, page and files."""
