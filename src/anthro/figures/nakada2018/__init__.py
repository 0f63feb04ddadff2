"""Figures of Nakada, Zhou, Chen, Weiss and Terzopoulos (2018)."""
