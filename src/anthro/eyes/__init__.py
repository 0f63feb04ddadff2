"""Two eyes: where their photoreceptors lie, how they move, what they see of the body's own world."""
