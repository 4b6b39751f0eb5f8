"""Intrinsic change of isosurfaces between simulation runs."""
