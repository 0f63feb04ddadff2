"""NeuroAnimator (Grzeszczuk, Terzopoulos & Hinton 1998): plants, their emulators, controllers learned through these."""
