"""Figures of Zhou, Nakada and Terzopoulos (2021)."""
