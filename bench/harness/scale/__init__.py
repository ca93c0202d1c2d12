"""Measurements of `bench/scale`: scans and clouds of up to a million points.

Peers do the same work. Every peer and server runs in a separate process.
"""
