"""NeuroAnimator (Grzeszczuk, Terzopoulos & Hinton 1998): plants, their emulators, and controllers learned through them."""
