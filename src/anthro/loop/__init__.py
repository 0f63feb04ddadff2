"""The closed sensorimotor loop (Nakada 2018, Sec. 7, Fig. 19): what is seen leads eyes, head and limbs.

Nothing here knows of the world that the body is in: rooms that do (`anthro.world`, `anthro.demos`) import this one, and
a test holds it to that.
"""
