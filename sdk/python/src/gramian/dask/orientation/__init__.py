"""Sides of a surface across tiles: regions of each, joined to pieces that have one side."""
