"""Figures of Grzeszczuk, Terzopoulos and Hinton (1998)."""
