"""Demos: each builds a task, runs the closed loop and writes a rollout and its metrics."""
