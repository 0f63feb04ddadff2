"""What the body meets: shapes to draw, and the paths on which they are drawn."""
