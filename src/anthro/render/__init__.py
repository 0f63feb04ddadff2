"""Film frames and videos by ray tracing."""
